"""What drives report, explained by the robot's file."""

from __future__ import annotations

from pathlib import Path

import pytest
from waiting import until

from cdpr_rt.service.service import DriveTextsError
from cdpr_tools.daemon.drive_texts import RobotDriveTexts
from tests.cdpr_rt.service.service_rig import running
from tests.tools.robot_rig import robot_file


def test_a_robots_file_that_was_spoilt_meanwhile_is_named(tmp_path: Path) -> None:
    path = robot_file(tmp_path, [("can0", 1), ("can0", 2)])
    good = path.read_text()
    path.write_text("spoilt")
    with running(tmp_path) as rig, rig.client() as client:
        rig.service.drives = texts = RobotDriveTexts(str(path))
        until(lambda: rig.block.counters["rows"][0] > 0)
        answer = client.get("/drives")
        assert answer.status_code == 409
        assert path.name in answer.json()["error"]
        path.write_text(good)
        assert len(client.get("/drives").json()["drives"]) == 2
        with pytest.raises(DriveTextsError, match="has no axis 2"):
            texts.object(2, 0x6041, 0, bytes(2))
