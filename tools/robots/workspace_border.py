"""The border of a robot's workspace for its page; run as a program with the robot's profile."""

from __future__ import annotations

import json
import sys
from typing import Any, Final

import numpy as np

from cdpr_profiles.calibration_in_force import load_calibrated
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.platform import NO_PLATFORM
from cdpr_rt.errors import ControlError
from cdpr_rt.model.statics import view_of
from cdpr_rt.model.workspace_analysis import criterion_of
from cdpr_tools.errors import FAILED, CommandError
from cdpr_tools.output import Output
from cdpr_tools.robots.workspace_search import Search, search

_CELLS: Final = 12
_RAYS: Final = {2: 180, 3: 800}
"""By the number of coordinates."""


def border(reference: str) -> dict[str, Any]:
    """Return the border of the static workspace, at the orientation of home; see `models.Border`.

    Raises CommandError, ControlError and ProfileError.
    """
    robot = load_calibrated(reference)
    if robot.platform is None:
        raise CommandError(f"{robot.path}: {NO_PLATFORM}")
    criterion = criterion_of(robot, 0.0, np.zeros((1, 3)), 0.0, contact_free=False)
    rays = _RAYS[len(robot.platform.home_m)]
    wanted = Search(criterion, view_of(robot.platform), _CELLS, rays, None, 1, None)
    found = search(wanted, Output(as_json=True)).rays
    triangles = [] if robot.platform.is_planar else found.triangles.tolist()
    return {"points_m": np.round(found.ends_m, 4).tolist(), "triangles": triangles}


if __name__ == "__main__":
    try:
        print(json.dumps(border(sys.argv[1])))
    except (CommandError, ControlError, ProfileError) as error:
        print(json.dumps({"error": str(error)}))
        sys.exit(FAILED)
