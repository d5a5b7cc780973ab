"""How pupils find a class: addresses, the name in the network, QR codes, certificates."""

import asyncio
import socket
import sys
from datetime import UTC, datetime, timedelta
from types import SimpleNamespace
from typing import ClassVar

import psutil
import pytest
from cryptography import x509

from motorcade.classroom import network
from motorcade.classroom.network import Network, class_keys, join_url, likely_first, qr_for_terminal, qr_svg, room_hosts
from support.class_page import class_room

LINUX = (("lo", "127.0.0.1"), ("docker0", "172.17.0.1"), ("br-12ab", "172.18.0.1"), ("virbr0", "192.168.122.1"))
WINDOWS = (("vEthernet (WSL)", "172.20.0.1"), ("Ethernet 2", "192.168.56.1"), ("Wi-Fi", "192.168.0.23"))
MAC = (("lo0", "127.0.0.1"), ("utun3", "100.64.0.9"), ("bridge100", "192.168.64.1"), ("en0", "192.168.1.7"))
MANY = (("eth0", "10.1.2.3"), ("eth0", "fe80::1%eth0"), ("eth1", "169.254.7.7"), ("wlan0", "192.168.1.5"))


def test_interfaces_that_are_up_have_addresses_of_the_internet(monkeypatch):
    addresses = {
        "eth0": [
            (socket.AF_INET, "10.0.0.5"),
            (socket.AF_INET6, "fe80::1%eth0"),
            (psutil.AF_LINK, "00:11:22:33:44:55"),
        ],
        "eth1": [(socket.AF_INET, "10.0.1.5")],
    }
    found = {name: [SimpleNamespace(family=kind, address=at) for kind, at in some] for name, some in addresses.items()}
    stats = {"eth0": SimpleNamespace(isup=True), "eth1": SimpleNamespace(isup=False), "lo": SimpleNamespace(isup=True)}
    monkeypatch.setattr(network.psutil, "net_if_addrs", lambda: found)
    monkeypatch.setattr(network.psutil, "net_if_stats", lambda: stats)
    assert network.interfaces() == [("eth0", "10.0.0.5"), ("eth0", "fe80::1%eth0")]


@pytest.mark.parametrize(
    ("found", "way_out", "first"),
    [
        (MANY, None, ["192.168.1.5", "10.1.2.3", "169.254.7.7"]),
        (MANY, "10.1.2.3", ["10.1.2.3", "192.168.1.5", "169.254.7.7"]),
        ((*MANY, *MANY, ("eth2", "8.8.8.8")), None, ["192.168.1.5", "10.1.2.3", "8.8.8.8", "169.254.7.7"]),
        # Tunnels and bridges are no way for tablets, whatever goes through them.
        ((*LINUX, ("tun0", "10.8.0.2"), ("enp3s0", "10.0.7.4")), "10.8.0.2", ["10.0.7.4", "10.8.0.2"]),
        (WINDOWS, None, ["192.168.0.23"]),
        (MAC, "100.64.0.9", ["192.168.1.7"]),
        (LINUX[:1], None, []),
        # Nobody connects to a group, nor to any address at all.
        ((("eth0", "224.0.0.251"), ("eth0", "0.0.0.0"), ("eth0", "192.168.1.5")), None, ["192.168.1.5"]),
        ((("eth0", "224.0.0.251"), ("eth0", "0.0.0.0")), None, []),
        ((("eth0", "fe80::1%eth0"), ("eth0", "2001:db8::5")), None, ["2001:db8::5"]),
        ((("eth0", "2001:db8::5"), ("eth0", "192.168.1.5")), None, ["192.168.1.5"]),
    ],
)
def test_the_address_that_tablets_reach_comes_first(found, way_out, first):
    assert likely_first(found, way_out)[: len(first) or None] == first


@pytest.mark.parametrize(
    ("listens", "has", "hosts"),
    [
        ("127.0.0.1", "8.8.8.8", ["127.0.0.1"]),
        ("0.0.0.0", "192.168.1.5", ["192.168.1.5"]),
        ("0.0.0.0", "127.0.0.1", ["127.0.0.1"]),
        ("0.0.0.0", "2001:db8::5", ["127.0.0.1"]),
        pytest.param(
            *("::", "2001:db8::5", ["2001:db8::5"]),
            marks=pytest.mark.skipif(not socket.has_ipv6, reason="this computer has no IPv6"),
        ),
    ],
)
def test_a_class_shows_the_addresses_at_which_it_listens(listens, has, hosts, monkeypatch):
    monkeypatch.setattr(network, "interfaces", lambda: [("eth0", has)])
    monkeypatch.setattr(network, "way_out", lambda: None)
    family = socket.AF_INET6 if ":" in listens else socket.AF_INET
    with socket.create_server((listens, 0), family=family) as listener:
        assert room_hosts(listener) == (hosts, "127.0.0.1")


def test_the_teacher_chooses_the_address_of_the_qr_code(tmp_path):
    here = Network(["192.168.1.5", "10.0.0.2"], 7710)
    with class_room(tmp_path, network=here) as room:
        first = room.teacher.ask("teacher/addresses")
        assert (first["local_name"], first["why_no_name"]) == (None, None)
        assert first["qr_code"].startswith("<svg")
        chosen = room.teacher.ask("teacher/choose-address", address="http://10.0.0.2:7710/")
        assert chosen["addresses"] == ["http://10.0.0.2:7710/", "http://192.168.1.5:7710/"]
        assert chosen["qr_code"] != first["qr_code"]
        assert chosen["qr_code"] == qr_svg(join_url("http://10.0.0.2:7710/", room.code))
        for foreign in ("http://evil.example/", "javascript:alert(1)", ""):
            assert room.teacher.ask("teacher/choose-address", address=foreign) == "not-found"
        assert room.teacher.ask("teacher/addresses") == chosen
        new = room.teacher.ask("teacher/new-code")
        assert new["code"] != chosen["code"]
        assert new["qr_code"] != chosen["qr_code"]


def announce(found):
    async def run():
        async with found.announced():
            assert len(Announcing.opened) == bool(found.local_name), "what announces nothing is closed at once"
            return found.local_name, found.why_no_name

    return asyncio.run(run())


def test_without_zeroconf_the_class_says_so_and_works(monkeypatch):
    monkeypatch.setitem(sys.modules, "zeroconf", None)
    name, why = announce(Network(["192.168.1.5"], 7710, announces=True))
    assert name is None
    assert "zeroconf" in why.sentence("zh")


class Announcing:
    """Takes announcements in place of the network."""

    problem = None
    opened: ClassVar[list] = []

    def __init__(self, interfaces):
        self.interfaces = interfaces
        Announcing.opened.append(self)

    def register_service(self, info, **named):
        Announcing.info = info
        if self.problem:
            raise self.problem

    def close(self):
        Announcing.opened.remove(self)


@pytest.fixture
def announcing(monkeypatch):
    monkeypatch.setattr("zeroconf.Zeroconf", Announcing)
    monkeypatch.setattr(Announcing, "problem", None)
    yield Announcing
    assert Announcing.opened == []


def test_the_name_is_announced_with_all_addresses(announcing):
    found = Network(["192.168.1.5", "10.0.0.2"], 7710, "https", announces=True)
    assert announce(found) == ("https://motorcade.local:7710/", None)
    assert announcing.info.server == "motorcade.local."
    assert announcing.info.parsed_addresses() == ["192.168.1.5", "10.0.0.2"]


@pytest.mark.parametrize("kind", ["taken", "forbidden", "gone"])
def test_a_name_that_cannot_be_announced_is_told_and_not_shown(announcing, monkeypatch, kind):
    from zeroconf import NonUniqueNameException

    problems = {"taken": NonUniqueNameException(), "forbidden": OSError(1, "not permitted"), "gone": RuntimeError("x")}
    monkeypatch.setattr(announcing, "problem", problems[kind])
    name, why = announce(Network(["192.168.1.5"], 7710, announces=True))
    assert name is None
    assert why.code == ("local-name-taken" if kind == "taken" else "local-name-not-announced")


def test_a_tunnel_that_takes_no_multicast_does_not_silence_the_other_addresses(announcing, monkeypatch):
    class WithoutTunnel(announcing):
        def register_service(self, info, **named):
            if "10.8.0.2" in self.interfaces:
                raise OSError(19, "No such device")
            super().register_service(info)

    monkeypatch.setattr("zeroconf.Zeroconf", WithoutTunnel)
    found = announce(Network(["192.168.1.5", "10.8.0.2"], 7710, announces=True))
    assert found == ("http://motorcade.local:7710/", None)
    assert announcing.info.parsed_addresses() == ["192.168.1.5"]


@pytest.mark.skipif(sys.platform == "darwin", reason="a Mac has one address of its own")
def test_a_tablet_finds_the_name_and_a_second_class_in_the_network_says_that_it_is_taken():
    """With real datagrams, on this computer's own interface.

    Each has an address of its own, as on another computer: what is sent to one address and port, Linux hands to any of
    the sockets that share them.
    """
    from zeroconf import AddressResolver
    from zeroconf.asyncio import AsyncZeroconf

    hosts = ["127.0.0.1"]
    first, second = Network(hosts, 7710, announces=True), Network(["127.0.0.2"], 7711, announces=True)

    async def run():
        async with first.announced():
            if first.local_name is None:
                pytest.skip(f"no multicast here: {first.why_no_name}")
            tablet = AsyncZeroconf(interfaces=["127.0.0.3"])
            asked = AddressResolver("motorcade.local.")
            found = await asked.async_request(tablet.zeroconf, 10_000)
            await tablet.async_close()
            async with second.announced():
                return found, asked.parsed_addresses(), second.local_name, second.why_no_name.code

    assert asyncio.run(run()) == (True, hosts, None, "local-name-taken")


def test_a_class_of_this_computer_alone_is_not_announced(announcing):
    assert announce(Network(["127.0.0.1"], 7710)) == (None, None)


def test_a_certificate_is_made_once_and_tablets_trust_it_also_at_new_addresses(tmp_path):
    now = datetime.now(UTC)
    first, public = class_keys(tmp_path, ["192.168.1.5"], now)
    made, authority = first.read_bytes(), public.read_bytes()
    assert class_keys(tmp_path, ["192.168.1.5"], now)[0].read_bytes() == made
    moved, _ = class_keys(tmp_path, ["192.168.1.6"], now)
    assert public.read_bytes() == authority
    certificate = x509.load_pem_x509_certificate(moved.read_bytes())
    certificate.verify_directly_issued_by(x509.load_pem_x509_certificate(authority))
    names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert "motorcade.local" in names.get_values_for_type(x509.DNSName)
    assert {"127.0.0.1", "192.168.1.6"} <= {*map(str, names.get_values_for_type(x509.IPAddress))}
    later, _ = class_keys(tmp_path, ["192.168.1.5"], now + timedelta(days=395))
    assert later.read_bytes() != made
    if sys.platform != "win32":
        assert first.stat().st_mode & 0o077 == 0


def test_the_terminal_shows_the_code_in_half_blocks():
    lines = qr_for_terminal("http://192.168.1.5:7710/join#ACDEFG").split("\n")
    assert len(lines[0]) // 2 <= len(lines) <= len(lines[0]) // 2 + 1
    assert {*"".join(lines)} == {*"█▀▄ "}
