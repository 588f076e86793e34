"""`cdpr drive lss`: set node id and bit rate of a new drive."""

from __future__ import annotations

import dataclasses
import re
from contextlib import closing
from dataclasses import dataclass
from typing import Annotated, Any

import typer

from cdpr_drivers.bus.simbus import open_clock
from cdpr_drivers.canopen.lss import (
    BITRATE_INDEX,
    NODE_ID_UNKNOWN,
    UNCONFIGURED,
    LssAddress,
    LssError,
    LssMaster,
)
from cdpr_drivers.canopen.sdo import ABSENT
from cdpr_drivers.cia402 import POWER_OFF, state_of
from cdpr_drivers.errors import BusError, SdoAbortError, SdoTimeoutError
from cdpr_profiles import DriveProfile, list_profiles, load_drive
from cdpr_tools.commands.options import JsonOption, option
from cdpr_tools.composition.session import open_bus
from cdpr_tools.consent import require_consent
from cdpr_tools.errors import BadInputError, WorkFailedError, raised_as
from cdpr_tools.output import Output

_UNITS = {"": 1, "k": 1_000, "m": 1_000_000}


app = typer.Typer()


@dataclass(frozen=True)
class _Device:
    """A device that LSS found; `profile` is the shipped or given profile for its type."""

    address: LssAddress
    node_id: int
    profile: str | None
    alone: bool = False
    """Whether the device is the only one on the bus, so that no search was needed."""

    @property
    def has_node_id(self) -> bool:
        """Whether the device is known to have a node id."""
        return self.node_id not in (UNCONFIGURED, NODE_ID_UNKNOWN)

    @property
    def as_dict(self) -> dict[str, Any]:
        own = self.node_id if self.has_node_id else None
        return dataclasses.asdict(self.address) | {"node_id": own, "profile": self.profile}

    def __str__(self) -> str:
        without = {UNCONFIGURED: "no node id", NODE_ID_UNKNOWN: "node id unknown"}
        node_id = without.get(self.node_id, f"node id {self.node_id}")
        return f"{self.address}: {node_id}; " + (
            f"profile {self.profile}" if self.profile else "no profile fits"
        )


@dataclass(frozen=True)
class _NewSettings:
    """The settings to write to one device."""

    node_id: int | None
    bitrate_bit_s: int | None
    store: bool
    activate_delay_s: float | None

    def __str__(self) -> str:
        changes = []
        if self.node_id is not None:
            changes.append(f"node id {self.node_id}")
        if self.bitrate_bit_s is not None:
            changes.append(f"bit rate {self.bitrate_bit_s // 1000} kbit/s")
        return " and ".join(changes)


@app.command()
def lss(
    bus: Annotated[str, option("simbus:NAME, socketcan:can0, ...", "--bus", metavar="URL")],
    profile: Annotated[
        str | None, option("Drive profile: finds devices of this type, with a node id or without.")
    ] = None,
    serial: Annotated[int | None, option("Its serial number.", min=0)] = None,
    alone: Annotated[
        bool, option("Set the only device on the bus, without a search.", "--alone")
    ] = False,
    node_id: Annotated[int | None, option("Node id to give it.", min=1, max=127)] = None,
    bitrate: Annotated[
        str | None, option("Bit rate to give it, such as 500k; takes effect at the next power-on.")
    ] = None,
    activate: Annotated[
        bool,
        option(
            "Change the bit rate immediately; change the bit rate of the bus at the same time.",
            "--activate",
        ),
    ] = False,
    switch_delay_ms: Annotated[
        int, option("Duration of silence before and after --activate.", min=1, max=30_000)
    ] = 1000,
    store: Annotated[bool, option("Store it in the device.", "--store/--no-store")] = (True),
    timeout_ms: Annotated[
        int, option("Longest time for an answer.", "--timeout-ms", min=1, max=10_000)
    ] = 100,
    yes: Annotated[bool, option("Do not ask before writing.", "--yes")] = False,
    as_json: JsonOption = False,
) -> None:
    """Find drives by LSS (CiA 305) and set a node id and bit rate."""
    out = Output(as_json)
    url = open_bus(bus)
    if url.starts_own_simulator:
        raise BadInputError(f"--bus {bus}: name an existing bus, such as simbus:NAME")
    if activate and bitrate is None:
        raise BadInputError("--activate: allowed only with --bitrate")
    if serial is not None and serial > 0xFFFFFFFF:
        raise BadInputError(f"--serial {serial}: allowed: 0 to {0xFFFFFFFF}")
    rate = None if bitrate is None else _bitrate(bitrate)
    new = _NewSettings(node_id, rate, store, switch_delay_ms * 1e-3 if activate else None)
    kind = None if profile is None else load_drive(profile)
    clock = open_clock([url])
    with raised_as(BadInputError, BusError):
        master = LssMaster(url, clock, timeout_ms * 1e-3)
    with closing(clock), master:
        out.note("looking for devices ...")
        found = [_only_device(master)] if alone else _search(master, profile, kind, serial)
        out.say(f"{len(found)} device{'s' * (len(found) != 1)} found")
        for device in found:
            out.say(f"  {device}")
        if master.hides_others:
            out.say(
                "A device that is listed answers to every search until it has a node id, which "
                "can hide others. Give it one, then search again."
            )
        if not found and (kind is not None or str(new)):
            raise WorkFailedError(_none_found(master, kind))
        if str(new):
            device = _choose(found)
            _check(master, device, found, new)
            question = f"on {url}: {device.address} gets {new}."
            require_consent(question, yes or url.is_simulated, "nothing was changed")
            _set(master, device, new, out)
    done = {
        "set": {"node_id": node_id, "bitrate_bit_s": rate, "stored": store} if str(new) else None
    }
    out.result({"ok": True, "found": [device.as_dict for device in found], **done})


def _bitrate(text: str) -> int:
    match = re.fullmatch(r"(\d+)(k|m|)(?:bit/s)?", text.strip().lower())
    rate = int(match[1]) * _UNITS[match[2]] if match else 0
    if rate not in BITRATE_INDEX:
        allowed = ", ".join(f"{rate // 1000}k" for rate in BITRATE_INDEX)
        raise BadInputError(f"--bitrate {text}: allowed: {allowed}")
    return rate


def _search(
    master: LssMaster, name: str | None, kind: DriveProfile | None, serial: int | None
) -> list[_Device]:
    """Return the devices of a type, or those without node id; the serial number narrows it down."""
    if kind is not None:
        serials = (0, 0xFFFFFFFF) if serial is None else (serial, serial)
        addresses = master.find(
            kind.vendor_id, kind.product_code, serials=serials, usual_revision=kind.revision
        )
    if kind is None or not addresses:  # some devices can be found by fastscan only
        addresses = [
            a
            for a in master.unconfigured()
            if serial in (None, a.serial)
            and (kind is None or (a.vendor_id, a.product_code) == _type(kind))
        ]
    known = {} if name is None or kind is None else {_type(kind): name}
    known = _shipped() | known
    return [
        _Device(a, master.select(a), known.get((a.vendor_id, a.product_code))) for a in addresses
    ]


def _only_device(master: LssMaster) -> _Device:
    address, node_id = master.select_only()
    kind = address.vendor_id, address.product_code
    return _Device(address, node_id, _shipped().get(kind), alone=True)


def _select(master: LssMaster, device: _Device) -> None:
    """Put the device into the configuration state; old devices support only the global switch."""
    if device.alone:
        master.select_only()
    else:
        master.select(device.address)


def _shipped() -> dict[tuple[int, int], str]:
    return {_type(load_drive(name)): name for name in list_profiles()["drives"]}


def _type(drive: DriveProfile) -> tuple[int, int]:
    return drive.vendor_id, drive.product_code


def _choose(found: list[_Device]) -> _Device:
    if len(found) == 1:
        return found[0]
    serials = ", ".join(str(device.address.serial) for device in found)
    raise BadInputError(f"{len(found)} devices found: choose one by --serial ({serials})")


def _none_found(master: LssMaster, kind: DriveProfile | None) -> str:
    """Return what to do if a search found no device."""
    if master.hides_others:
        return (
            "no such device found: another device hides it. Search without --profile and --serial, "
            "and give that one a node id first"
        )
    if kind is None and master.has_unconfigured():
        return (
            "no device found: there is a device without a node id, but it does not take "
            "part in the search: give its --profile and --serial, or connect it alone and "
            "use --alone"
        )
    looked_for = "" if kind is None else f" of vendor {kind.vendor_id:08X}h"
    return (
        f"no device{looked_for} found: check power, wiring, termination and bit rate; a device "
        "with a node id is found by its --profile, or by --alone if it is the only one on the bus"
    )


def _check(master: LssMaster, device: _Device, found: list[_Device], new: _NewSettings) -> None:
    """Reject a node id that is taken, and a drive that has power."""
    node_id = new.node_id
    if node_id is not None and node_id != device.node_id:
        other = next((d for d in found if d.node_id == node_id and d != device), None)
        sign = f"it is {other.address}" if other else master.node_id_in_use(node_id)
        if sign:
            raise BadInputError(f"--node-id {node_id}: taken by another node ({sign})")
    if device.has_node_id:
        _check_power(master, device.node_id)


def _check_power(master: LssMaster, node_id: int) -> None:
    """Reject a drive whose power stage is enabled or whose state is unknown."""
    try:
        state = state_of(master.read_object(node_id, 0x6041))
    except SdoAbortError as error:
        if error.code in ABSENT:
            return  # no drive
        reason = str(error)
    except SdoTimeoutError:
        reason = "it does not answer SDO requests and may be stopped; switch it off and on first"
    else:
        if state in POWER_OFF:
            return
        raise WorkFailedError(
            f"node {node_id} has its power stage enabled: stop the other master first"
        )
    raise WorkFailedError(
        f"node {node_id} does not report whether its power stage is enabled: {reason}"
    )


def _set(master: LssMaster, device: _Device, new: _NewSettings, out: Output) -> None:
    _select(master, device)
    if new.node_id is not None:
        master.set_node_id(new.node_id)
    if new.bitrate_bit_s is not None:
        master.set_bitrate(new.bitrate_bit_s)
    if new.store:
        try:
            master.store()
        except LssError as error:
            raise WorkFailedError(
                f"{error}; the settings are lost at power-off (--no-store skips storing)"
            ) from error
    out.say(f"{device.address}: {new} set" + (" and stored" if new.store else ", not stored"))
    if new.node_id is not None:
        _restart(master, device, new.node_id, out)
    if new.bitrate_bit_s is not None:
        _change_over(master, device, new, out)


def _restart(master: LssMaster, device: _Device, new: int, out: Output) -> None:
    """Make the device use its new node id."""
    old = device.node_id
    master.release()
    if device.has_node_id and old != new:
        master.reset_communication(old)
    if old != new and not master.wait_for_boot_up(new):
        raise WorkFailedError(
            f"node {new} sent no boot-up message; switch the drive off and on, then check again"
        )
    out.say(f"node {new} has booted")


def _change_over(master: LssMaster, device: _Device, new: _NewSettings, out: Output) -> None:
    """Change the bit rate now, or report when it will change."""
    rate = f"{(new.bitrate_bit_s or 0) // 1000} kbit/s"
    if new.activate_delay_s is None:
        out.say(
            f"{rate} take effect at the next power-on; then the whole bus must use this "
            "rate: every other drive, the adapter, and bitrate_bit_s in the winch's file"
        )
        return
    _select(master, device)
    master.activate_bitrate(new.activate_delay_s)
    out.say(
        f"the device stops sending, changes to {rate} after {new.activate_delay_s:g} s "
        f"and sends again {new.activate_delay_s:g} s later; change the adapter's bit "
        "rate in between"
    )
