"""Bus URLs are parsed, printed and rejected."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.errors import BusError


@pytest.mark.parametrize(
    ("text", "interface", "channel", "options"),
    [
        ("simbus:", "simbus", "", {}),
        ("simbus:one", "simbus", "one", {}),
        ("socketcan:vcan0", "socketcan", "vcan0", {}),
        ("slcan:/dev/ttyACM0?bitrate=1000000", "slcan", "/dev/ttyACM0", {"bitrate": 1000000}),
        ("socketcand://host:29536/can0", "socketcand", "can0", {"host": "host", "port": 29536}),
        ("socketcand://[::1]:1/can0", "socketcand", "can0", {"host": "::1", "port": 1}),
        (
            "kvaser:0?bitrate=500000&accept_virtual=true&driver_mode=x",
            "kvaser",
            "0",
            {"bitrate": 500000, "accept_virtual": True, "driver_mode": "x"},
        ),
    ],
)
def test_known_forms_are_parsed(
    text: str, interface: str, channel: str, options: dict[str, object]
) -> None:
    url = BusUrl.parse(text)
    assert (url.interface, url.channel, url.options) == (interface, channel, options)
    assert url.starts_own_simulator == (text == "simbus:")
    assert url.is_simulated == text.startswith("simbus:")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "interface and a colon are missing"),
        ("vcan0", "interface and a colon are missing"),
        ("sokcetcan:vcan0", "unknown interface 'sokcetcan'"),
        ("socketcan:", "channel after the colon is missing"),
        ("socketcan:a-name-much-too-long", "cannot be a network interface"),
        ("simbus:a b", "a simbus name has"),
        ("simbus:../x", "a simbus name has"),
        ("simbus:one?bitrate=5", "has no options"),
        ("slcan:/dev/ttyACM0?bitrate", "write options as"),
        ("socketcand:can0", "write it as socketcand://"),
        ("socketcand://host:99999/can0", "write it as socketcand://"),
    ],
)
def test_error_for_an_invalid_url_quotes_it(text: str, message: str) -> None:
    with pytest.raises(BusError, match=message) as caught:
        BusUrl.parse(text)
    assert repr(text) in str(caught.value)


@given(st.text(max_size=40))
@settings(max_examples=100)
def test_any_text_is_a_url_or_a_bus_error(text: str) -> None:
    try:
        url = BusUrl.parse(text)
    except BusError:
        return
    assert BusUrl.parse(str(url)) == url


@pytest.mark.parametrize(
    "text",
    ["simbus:x", "socketcan:can0", "slcan:/dev/tty0?bitrate=125000", "socketcand://h:1/can0"],
)
def test_a_url_prints_as_it_was_written(text: str) -> None:
    assert str(BusUrl.parse(text)) == text
