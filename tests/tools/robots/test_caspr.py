"""`cdpr robot import` writes a robot's file from a CASPR model."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from cdpr_profiles import load_robot
from cdpr_tools.robots.caspr import read_caspr
from tests.cdpr_here import cdpr_here

BODIES = """<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE bodies_system SYSTEM "../../../../templates/bodies.dtd">
<bodies_system><links><link_rigid num="1" name="Link 1">
  <joint type="PLANAR_XZ" q_initial="0 0 0"/>
  <physical><mass>2.5</mass><com_location>0.02 0 -0.01</com_location></physical>
  <parent><num>0</num><location>0.5 0 0</location></parent>
</link_rigid></links></bodies_system>
"""
CABLE = """<cable_ideal name="cable {number}" attachment_reference="{reference}">
  <properties><force_min>{least}</force_min><force_max>{most}</force_max></properties>
  <attachments>
    <attachment><link>0</link><location>{exit}</location></attachment>
    <attachment><link>1</link><location>{anchor}</location></attachment>
  </attachments></cable_ideal>"""
EXITS = ["-1.5 0 0.2", "-1.5 0 2.8", "2.5 0 2.8", "2.5 0 0.2"]
ANCHORS = ["-0.1 0 0.1", "-0.1 0 -0.1", "0.1 0 -0.1", "0.1 0 0.1"]


def cables(
    exits: list[str] = EXITS, reference: str = "joint", least: float = 0.0, most: float = 120.0
) -> str:
    each = (
        CABLE.format(
            number=number + 1, reference=reference, exit=exit_m, anchor=ANCHORS[number % 4],
            least=least, most=most,
        )
        for number, exit_m in enumerate(exits)
    )  # fmt: skip
    unused = '<cable_set id="other"></cable_set>'
    chosen = f'<cable_set id="basic">{"".join(each)}</cable_set>'
    return f'<cables default_cable_set="basic">{unused}{chosen}</cables>'


def turned(text: str, plane: tuple[int, int]) -> str:
    """Return a file of the model with the coordinates x and z along those of `plane`."""

    def point(match: re.Match[str]) -> str:
        x, _, z = match[1].split()
        coordinates = ["0", "0", "0"]
        coordinates[plane[0]], coordinates[plane[1]] = x, z
        return f">{' '.join(coordinates)}</{match[2]}>"

    return re.sub(r">([^<> ]+ [^<> ]+ [^<> ]+)</((?:com_)?location)>", point, text)


def imported(
    folder: Path, bodies: str = BODIES, cables: str = cables(), *options: str
) -> tuple[int, str, Path]:
    """Import a model; return the exit status, the output and the robot's file."""
    (folder / "b.xml").write_text(bodies)
    (folder / "c.xml").write_text(cables)
    path = folder / "robot.toml"
    files = (str(folder / "b.xml"), str(folder / "c.xml"), str(path))
    done = cdpr_here("robot", "import", *files, *options)
    return done.returncode, done.stdout + done.stderr, path


def test_geometry_and_mass_come_from_the_model(tmp_path: Path) -> None:
    status, output, path = imported(tmp_path)
    assert status == 0, output
    robot = load_robot(path)
    assert robot.platform is not None
    assert robot.platform.mass_kg == 2.5
    # relative to the parent, and to the centre of mass
    assert robot.platform.exit_points_m[0] == pytest.approx((-2.0, 0.2))
    assert robot.platform.anchor_points_m[0] == pytest.approx((-0.12, 0.11))
    assert robot.limits.tension_max_N == (120.0,)
    assert robot.limits.tension_min_N == pytest.approx((1.2,))


def test_a_horizontal_plane_is_rejected_and_read_upright_only_on_request(tmp_path: Path) -> None:
    bodies, given = (turned(text, (0, 1)) for text in (BODIES.replace("XZ", "XY"), cables()))
    status, output, path = imported(tmp_path, bodies, given)
    assert status == 2
    assert "joint: type 'PLANAR_XY': the plane is horizontal" in output
    assert "a robot's file has no key to turn it off" in output
    assert not path.exists()
    status, output, path = imported(tmp_path, bodies, given, "--upright")
    assert status == 0, output
    assert "gravity: the model's plane is horizontal; this robot stands upright" in output
    upright = load_robot(path).platform
    path.unlink()
    imported(tmp_path)
    assert load_robot(path).platform == upright


def test_a_vertical_plane_of_y_and_z_has_the_same_robot_as_one_of_x_and_z(tmp_path: Path) -> None:
    *_, path = imported(tmp_path)
    platform = load_robot(path).platform
    path.unlink()
    bodies, given = (turned(text, (1, 2)) for text in (BODIES.replace("XZ", "YZ"), cables()))
    status, output, path = imported(tmp_path, bodies, given)
    assert status == 0, output
    assert load_robot(path).platform == platform


def test_a_model_may_have_the_encoding_that_it_declares(tmp_path: Path) -> None:
    text = BODIES.replace("utf-8", "iso-8859-1").replace("Link 1", "Plattform für 2 kg")
    (tmp_path / "b.xml").write_bytes(text.encode("latin-1"))
    (tmp_path / "c.xml").write_text(cables())
    assert read_caspr(tmp_path / "b.xml", tmp_path / "c.xml")


def test_targets_are_not_turned_unless_the_angle_is_given(tmp_path: Path) -> None:
    *_, output, path = imported(tmp_path)
    assert "not from the model: angle_deg: models have none" in output
    platform = load_robot(path).platform
    assert platform is not None
    assert platform.workspace_angle_rad == 0.0
    path.unlink()
    *_, path = imported(tmp_path, BODIES, cables(), "--set", "angle_deg=3")
    platform = load_robot(path).platform
    assert platform is not None
    assert platform.workspace_angle_rad == pytest.approx(np.radians(3.0), rel=1e-4)


def test_a_model_with_seven_cables_has_seven_axes_on_two_buses(tmp_path: Path) -> None:
    shipped = load_robot("spatial-8").platform
    assert shipped is not None
    ends = zip(shipped.exit_points_m[:7], shipped.anchor_points_m, strict=False)
    each = "".join(
        CABLE.format(
            number=number, reference="joint", least=1.0, most=150.0,
            exit=" ".join(map(str, exit_m)), anchor=" ".join(map(str, anchor_m)),
        )
        for number, (exit_m, anchor_m) in enumerate(ends, start=1)
    )  # fmt: skip
    bodies = BODIES.replace("PLANAR_XZ", "SPATIAL_EULER_XYZ").replace("2.5<", "10<")
    bodies = re.sub(r">[^<> ]+ [^<> ]+ [^<> ]+<", ">0 0 0<", bodies)
    *_, output, path = imported(
        tmp_path, bodies, f'<cables><cable_set id="only">{each}</cable_set></cables>'
    )
    assert path.exists(), output
    assert "Traceback" not in output
    robot = load_robot(path)
    assert [axis.node_id for axis in robot.axes] == [1, 2, 3, 4, 5, 6, 7]
    assert len(robot.buses) == 2
    assert robot.platform is not None
    assert robot.platform.exit_points_m == shipped.exit_points_m[:7]


def test_attachments_may_refer_to_the_centre_of_mass(tmp_path: Path) -> None:
    *_, path = imported(tmp_path, cables=cables(reference="com"))
    platform = load_robot(path).platform
    assert platform is not None
    assert platform.anchor_points_m[0] == pytest.approx((-0.1, 0.1))


def test_tensions_beyond_the_winches_are_not_taken_and_named(tmp_path: Path) -> None:
    _, output, path = imported(tmp_path, cables=cables(most=5000.0))
    assert "not from the model: tension_max_N: value 5000" in output
    assert max(load_robot(path).limits.tension_max_N or ()) < 500.0


@pytest.mark.parametrize(
    ("bodies", "given", "reason"),
    [
        (BODIES.replace("PLANAR_XZ", "S_EULER_XYZ"), cables(), "joint: type 'S_EULER_XYZ'"),
        (BODIES.replace("2.5<", "<"), cables(), "mass"),
        (BODIES.replace("0.02 0 -0.01", "0.02 x 0"), cables(), "com_location: '0.02 x 0'"),
        ("<bodies_system><links/></bodies_system>", cables(), "links: 0 bodies"),
        ("<other/>", cables(), "begins with <other>"),
        ("no xml", cables(), "is not XML"),
        (BODIES, cables(EXITS[:2]), "2 cables make it planar-2; allowed: planar-3"),
        (BODIES, cables().replace("<link>0", "<link>1"), "attachments"),
        (BODIES, cables().replace('"basic"', '"new"', 1), "no set is called 'new'"),
    ],
)
def test_a_model_that_cannot_be_imported_is_rejected_with_file_and_element(
    tmp_path: Path, bodies: str, given: str, reason: str
) -> None:
    status, output, path = imported(tmp_path, bodies, given)
    assert status == 2
    assert reason in output
    assert "Traceback" not in output
    assert not path.exists()
