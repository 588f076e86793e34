"""Print the OpenAPI description of the control interface, from which the page's types are
generated."""

from __future__ import annotations

import json

from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.service.http_app import create_app
from cdpr_rt.service.service import Service

if __name__ == "__main__":
    service = Service(SharedBlock.create(1, 1.0, 1e3), "robot")
    print(json.dumps(create_app(service).openapi()))
