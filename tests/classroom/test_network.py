"""How pupils find a class: addresses, the name in the network, QR codes, certificates."""

import asyncio
import socket
import ssl
import sys
from datetime import UTC, datetime, timedelta

import pytest

from motorcade.classroom import network
from motorcade.classroom.network import Network, class_keys, join_url, likely_first, qr_for_terminal, qr_svg, room_hosts
from support.class_page import class_room


def test_the_address_that_tablets_reach_comes_first():
    found = [
        ("lo", "127.0.0.1"),
        ("docker0", "172.17.0.1"),
        ("eth0", "10.1.2.3"),
        ("eth0", "fe80::1%eth0"),
        ("eth1", "169.254.7.7"),
        ("tun0", "10.8.0.2"),
        ("wlan0", "192.168.1.5"),
        ("wlan0", "192.168.1.5"),
        ("eth2", "8.8.8.8"),
    ]
    ends = ["169.254.7.7", "10.8.0.2", "172.17.0.1"]
    assert likely_first(found) == ["192.168.1.5", "10.1.2.3", "8.8.8.8", *ends]
    assert likely_first(found, "10.1.2.3") == ["10.1.2.3", "192.168.1.5", "8.8.8.8", *ends]
    assert likely_first(found, "10.8.0.2")[-2] == "10.8.0.2", "a tunnel is no way for tablets"
    assert likely_first([("lo", "127.0.0.1")]) == []


def test_a_computer_of_many_networks_shows_that_of_the_room_first():
    """Docker, virtual machines, a VPN that all traffic takes, and names as Windows and macOS have them."""
    linux = [("lo", "127.0.0.1"), ("docker0", "172.17.0.1"), ("br-12ab", "172.18.0.1"), ("virbr0", "192.168.122.1")]
    assert likely_first([*linux, ("tun0", "10.8.0.2"), ("enp3s0", "10.0.7.4")], "10.8.0.2")[0] == "10.0.7.4"
    windows = [("vEthernet (WSL)", "172.20.0.1"), ("Ethernet 2", "192.168.56.1"), ("Wi-Fi", "192.168.0.23")]
    assert likely_first(windows, "192.168.0.23")[0] == "192.168.0.23"
    assert likely_first(windows)[0] == "192.168.0.23", "without a way out to the Internet"
    mac = [("lo0", "127.0.0.1"), ("utun3", "100.64.0.9"), ("bridge100", "192.168.64.1"), ("en0", "192.168.1.7")]
    assert likely_first(mac, "100.64.0.9")[0] == "192.168.1.7"
    assert likely_first([("eth0", "fe80::1%eth0"), ("eth0", "2001:db8::5")]) == ["2001:db8::5"], "nothing but IPv6"
    assert likely_first([("eth0", "2001:db8::5"), ("eth0", "192.168.1.5")]) == ["192.168.1.5"]


def test_a_computer_without_a_network_shows_its_own_address(monkeypatch):
    monkeypatch.setattr(network, "interfaces", lambda: [("lo", "127.0.0.1"), ("lo", "::1")])
    monkeypatch.setattr(network, "way_out", lambda: None)
    with socket.create_server(("0.0.0.0", 0)) as listener:
        assert room_hosts(listener) == (["127.0.0.1"], "127.0.0.1")
        monkeypatch.setattr(network, "interfaces", lambda: [("eth0", "2001:db8::5")])
        assert room_hosts(listener)[0] == ["127.0.0.1"], "it listens at no address of IPv6"


@pytest.mark.skipif(not socket.has_ipv6, reason="this computer has no IPv6")
def test_a_class_that_listens_at_ipv6_shows_those_addresses(monkeypatch):
    monkeypatch.setattr(network, "interfaces", lambda: [("eth0", "fe80::1%eth0"), ("eth0", "2001:db8::5")])
    monkeypatch.setattr(network, "way_out", lambda: None)
    with socket.create_server(("::", 0), family=socket.AF_INET6) as listener:
        hosts, _ = room_hosts(listener)
    assert Network(hosts, 7710).addresses == ["http://[2001:db8::5]:7710/"]


def test_the_teacher_chooses_the_address_of_the_qr_code(tmp_path):
    here = Network(["192.168.1.5", "10.0.0.2"], 7710)
    with class_room(tmp_path, network=here) as room:
        first = room.teacher.ask("teacher/addresses")
        chosen = room.teacher.ask("teacher/choose-address", address="http://10.0.0.2:7710/")
        assert chosen["addresses"] == ["http://10.0.0.2:7710/", "http://192.168.1.5:7710/"]
        assert chosen["qr_code"] != first["qr_code"]
        assert chosen["qr_code"] == qr_svg(join_url("http://10.0.0.2:7710/", room.code))
        for foreign in ("http://evil.example/", "javascript:alert(1)", ""):
            assert room.teacher.ask("teacher/choose-address", address=foreign) == "not-found"
        assert room.teacher.ask("teacher/addresses") == chosen


def test_a_class_at_one_address_shows_that_one():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        assert room_hosts(listener) == (["127.0.0.1"], "127.0.0.1")
    with socket.create_server(("0.0.0.0", 0)) as listener:
        hosts, own = room_hosts(listener)
    assert own == "127.0.0.1"
    assert hosts


def scanned(picture):
    """The modules of a QR code that is drawn with half blocks."""
    pairs = {"█": (0, 0), "▀": (0, 1), "▄": (1, 0), " ": (1, 1)}
    rows = []
    for line in picture.split("\n"):
        halves = [pairs[sign] for sign in line]
        rows += [[upper for upper, _ in halves], [lower for _, lower in halves]]
    return rows


def test_the_terminal_shows_the_same_code_as_the_page():
    import segno

    text = "http://192.168.1.5:7710/join#ACDEFG"
    expected = [[int(bool(module)) for module in row] for row in segno.make(text, error="l").matrix_iter(border=2)]
    assert scanned(qr_for_terminal(text))[: len(expected)] == expected


def test_without_zeroconf_the_class_says_so_and_works(monkeypatch):
    monkeypatch.setitem(sys.modules, "zeroconf", None)
    found = Network(["192.168.1.5"], 7710, announces=True)

    async def run():
        async with found.announced():
            assert found.local_name is None
            assert "zeroconf" in found.why_no_name.sentence("zh")

    asyncio.run(run())


class Announcing:
    """Takes announcements in place of the network."""

    taken = False
    problem = None

    def __init__(self, interfaces):
        self.interfaces = interfaces
        self.closed = False

    async def async_register_service(self, info):
        Announcing.info = info
        if self.problem:
            raise self.problem

    async def async_close(self):
        Announcing.closed_last = True


@pytest.fixture
def announcing(monkeypatch):
    import zeroconf.asyncio

    monkeypatch.setattr(zeroconf.asyncio, "AsyncZeroconf", Announcing)
    monkeypatch.setattr(Announcing, "problem", None)
    return Announcing


def announce(found):
    async def run():
        async with found.announced():
            return found.local_name, found.why_no_name

    return asyncio.run(run())


def test_the_name_is_announced_with_all_addresses(announcing):
    found = Network(["192.168.1.5", "10.0.0.2"], 7710, "https", announces=True)
    assert announce(found) == ("https://motorcade.local:7710/", None)
    assert announcing.info.server == "motorcade.local."
    assert announcing.info.parsed_addresses() == ["192.168.1.5", "10.0.0.2"]
    assert announcing.closed_last


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
        async def async_register_service(self, info):
            if "10.8.0.2" in self.interfaces:
                raise OSError(19, "No such device")
            await super().async_register_service(info)

    monkeypatch.setattr("zeroconf.asyncio.AsyncZeroconf", WithoutTunnel)
    found = announce(Network(["192.168.1.5", "10.8.0.2"], 7710, announces=True))
    assert found == ("http://motorcade.local:7710/", None)
    assert announcing.info.parsed_addresses() == ["192.168.1.5"]


def test_a_tablet_finds_the_name_and_a_second_class_in_the_network_says_that_it_is_taken():
    """With real datagrams, on this computer's own interface."""
    from zeroconf import AddressResolver
    from zeroconf.asyncio import AsyncZeroconf

    hosts = ["127.0.0.1"]
    first, second = Network(hosts, 7710, announces=True), Network(hosts, 7711, announces=True)

    async def run():
        async with first.announced():
            if first.local_name is None:
                pytest.skip(f"no multicast here: {first.why_no_name}")
            tablet = AsyncZeroconf(interfaces=hosts)
            asked = AddressResolver("motorcade.local.")
            found = await asked.async_request(tablet.zeroconf, 10_000)
            await tablet.async_close()
            async with second.announced():
                return found, asked.parsed_addresses(), second.local_name, second.why_no_name.code

    assert asyncio.run(run()) == (True, hosts, None, "local-name-taken")


def test_a_class_of_this_computer_alone_is_not_announced():
    assert announce(Network(["127.0.0.1"], 7710)) == (None, None)
    assert network.LOCAL_NAME == "motorcade.local"


def hosts_of(keys, authority):
    """The addresses for which a certificate is good, by a real handshake in memory."""
    server = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    server.load_cert_chain(keys)
    client = ssl.create_default_context(cafile=authority)
    good = []
    for host in ("motorcade.local", "127.0.0.1", "192.168.1.5", "192.168.1.6", "evil.example"):
        ways = ssl.MemoryBIO(), ssl.MemoryBIO()
        ends = (
            client.wrap_bio(ways[0], ways[1], server_hostname=host),
            server.wrap_bio(ways[1], ways[0], server_side=True),
        )
        try:
            for _ in range(3):
                for end in ends:
                    try:
                        end.do_handshake()
                    except ssl.SSLWantReadError:
                        continue
            good.append(host)
        except ssl.SSLCertVerificationError:
            continue
    return good


def test_a_certificate_is_made_once_and_tablets_trust_it_also_at_new_addresses(tmp_path):
    # Backdated by a year, a certificate of now is good now.
    now = datetime.now(UTC)
    first = class_keys(tmp_path, ["192.168.1.5"], now)
    assert hosts_of(first.server, first.authority) == ["motorcade.local", "127.0.0.1", "192.168.1.5"]
    made = first.server.read_bytes()
    assert class_keys(tmp_path, ["192.168.1.5"], now).server.read_bytes() == made
    authority = first.authority.read_bytes()
    moved = class_keys(tmp_path, ["192.168.1.6"], now)
    assert "192.168.1.6" in hosts_of(moved.server, moved.authority)
    assert moved.authority.read_bytes() == authority
    later = class_keys(tmp_path, ["192.168.1.5"], now + timedelta(days=395))
    assert later.server.read_bytes() != made
    if sys.platform != "win32":
        assert first.server.stat().st_mode & 0o077 == 0
