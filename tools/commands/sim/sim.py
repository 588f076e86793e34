"""`cdpr sim`: what is simulated, on buses of its own or on real ones."""

from __future__ import annotations

from cdpr_tools.command_group import lazy_group

MODULES = {
    "sim.sim_up": {
        "up": "Run simulated drives until Ctrl-C; tells on standard output when they are up.",
    },
    "sim.sim_devices": {
        "safety-io": "Run a simulated safety I/O until Ctrl-C; tells on standard output when it is "
        "up.",
        "panel": "Press the emergency stop of a simulated safety I/O, release it, break or mend "
        "something.",
        "rail": "Run a simulated rail until Ctrl-C; tells on standard output when it is up.",
    },
    "sim.sim_fault": {
        "fault": "Have something go wrong on a simulated robot that runs: a cable, an encoder, a "
        "drive.",
    },
    "sim.sim_camera": {
        "camera": "Run a camera on a simulated platform until Ctrl-C; other commands know it as "
        "sim:SOCKET.",
        "photos": "Write images of a simulated camera from random poses, without a robot; and its "
        "intrinsics.",
    },
    "sim.sim_tension": {
        "tension": "Run simulated load cells on a pseudo-terminal until Ctrl-C; tells its path "
        "when it is up.",
        "hang": 'Hang a mass on a simulated cable whose plant has load.kind = "hung_mass".',
    },
    "sim.sim_verify": {
        "verify": "Run a command on simulated drives several times; exit status 1 where files "
        "differ.",
    },
}

app = lazy_group("sim", "Simulated winches on a CAN bus.", MODULES)
