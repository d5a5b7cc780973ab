"""How pupils find a class: the addresses of this computer, its name in the network, a QR code and a certificate."""

import asyncio
import hashlib
import io
import ipaddress
import socket
from collections.abc import AsyncIterator, Iterable, Sequence
from contextlib import ExitStack, asynccontextmanager
from datetime import datetime, timedelta
from pathlib import Path

import psutil
import segno
from cryptography import x509

from motorcade.config.files import read_bytes
from motorcade.drive.certificates import AUTHORITY_PUBLIC, CarKeys, make_keys
from motorcade.drive.keys import CAR
from motorcade.errors import InputError, MotorcadeError
from motorcade.extras import install_command
from motorcade.fleet.places import registered
from motorcade.server.running import url_of
from motorcade.sockets import way_out

LOCAL_NAME = "motorcade.local"
_NAME = "motorcade"
_OWN = "127.0.0.1"
_SERVICE = "_http._tcp.local."
# Interfaces of these names are bridges and tunnels of programs on this computer: no tablet reaches it by them.
_VIRTUAL = (
    *("docker", "podman", "cni", "lxc", "lxd", "br-", "bridge", "veth", "vethernet", "virbr", "vmnet", "vmware"),
    *("vboxnet", "virtualbox", "tun", "tap", "utun", "wg", "wireguard", "tailscale", "zt", "zerotier", "ppp", "ipsec"),
)
# A certificate that lasts for less than this is made anew.
_LEAST = timedelta(days=14)
_FAMILIES = (socket.AF_INET, socket.AF_INET6)
_WIRELESS = ("wl", "wi-fi", "wlan", "ath")


class Network:
    """How pupils find a class.

    Args:
        hosts: the addresses of this computer, the likeliest first, without port.
        port: where it listens.
        scheme: http or https.
        announces: whether `LOCAL_NAME` is to be announced by multicast DNS; not where only this computer is reached.

    Attributes:
        local_name: the address with `LOCAL_NAME`; None where it isn't announced.
        why_no_name: why it isn't.
    """

    def __init__(self, hosts: Sequence[str], port: int, scheme: str = "http", announces: bool = False) -> None:
        self.addresses = [url_of(host, port, scheme=scheme) for host in hosts]
        self.local_name: str | None = None
        self.why_no_name: MotorcadeError | None = None
        self._hosts = list(hosts)
        self._port = port
        self._scheme = scheme
        self._announces = announces

    def choose(self, address: str) -> None:
        """Show one of the addresses first: the room's tablets reach it. Raises MotorcadeError for any other."""
        if address not in self.addresses:
            raise MotorcadeError("not-found")
        self.addresses.sort(key=lambda shown: shown != address)

    @asynccontextmanager
    async def announced(self) -> AsyncIterator[None]:
        """Announce the name by multicast DNS (RFC 6762) while the block runs; without it the class works by addresses.

        Where an interface can't do it, such as a tunnel, the likeliest address alone is announced.
        """
        announcing = ExitStack()
        try:
            if self._announces:
                # Asking whether the name is free takes a second.
                self.why_no_name = await asyncio.to_thread(self._announce, announcing)
                if self.why_no_name is None:
                    self.local_name = url_of(LOCAL_NAME, self._port, scheme=self._scheme)
            yield
        finally:
            await asyncio.to_thread(announcing.close)

    def _announce(self, announcing: ExitStack) -> MotorcadeError | None:
        """Announce the name until ``announcing`` is closed; return why that isn't possible, or None."""
        try:
            from zeroconf import NonUniqueNameException
        except ModuleNotFoundError:
            return MotorcadeError("local-name-needs-zeroconf", name=LOCAL_NAME, command=install_command("class"))
        server = f"{LOCAL_NAME}."
        properties = {"path": "/join"}
        reason: Exception | None = None
        for hosts in (self._hosts, self._hosts[:1]):
            try:
                announcing.enter_context(registered(_SERVICE, "Motorcade", self._port, properties, server, hosts))
            except NonUniqueNameException:
                return MotorcadeError("local-name-taken", name=LOCAL_NAME)
            except (OSError, RuntimeError) as problem:
                # RuntimeError: an interface is gone.
                reason = problem
            else:
                return None
        return MotorcadeError("local-name-not-announced", name=LOCAL_NAME, reason=reason)


def interfaces() -> list[tuple[str, str]]:
    """Return the names and the addresses of the network interfaces of this computer that are up."""
    addresses = psutil.net_if_addrs()
    found = []
    for name, status in psutil.net_if_stats().items():
        if status.isup:
            internet = (address for address in addresses.get(name, ()) if address.family in _FAMILIES)
            found += [(name, address.address) for address in internet]
    return found


def likely_first(found: Iterable[tuple[str, str]], way_out: str | None = None) -> list[str]:
    """Return the addresses by which others in the room may reach this computer, the likeliest first.

    Args:
        found: names and addresses of network interfaces.
        way_out: the address from which this computer sends to the Internet, or would; None where there is none.

    Returns:
        Addresses of IPv4, since nobody types others: first ``way_out``, then private ones, those of wireless
        interfaces before others, those of virtual interfaces last. Those of the computer alone are left out. Where
        there is none, those of IPv6, without link-local ones, which browsers don't open.
    """
    of_ipv4 = []
    of_ipv6 = []
    for name, text in found:
        address = ipaddress.ip_address(text.partition("%")[0])
        if address.is_loopback or address.is_unspecified or address.is_multicast:
            continue
        if address.version == 4:
            of_ipv4.append((name, text, address))
        elif not address.is_link_local:
            of_ipv6.append((name, text, address))
    ranked = []
    for name, text, address in of_ipv4 or of_ipv6:
        virtual = name.lower().startswith(_VIRTUAL)
        wireless = name.lower().startswith(_WIRELESS)
        ranked.append((virtual, address.is_link_local, text != way_out, not address.is_private, not wireless, text))
    return list(dict.fromkeys(rank[-1] for rank in sorted(ranked)))


def room_hosts(listener: socket.socket) -> tuple[list[str], str]:
    """Return the addresses by which others reach a listening socket, the likeliest first, and this computer's own."""
    host = listener.getsockname()[0]
    if not ipaddress.ip_address(host.partition("%")[0]).is_unspecified:
        return [host], host
    found = interfaces()
    if listener.family == socket.AF_INET:
        found = [(name, address) for name, address in found if ":" not in address]
    return likely_first(found, way_out()) or [_OWN], _OWN


def join_url(address: str, code: str) -> str:
    """Return the address that the QR code has: the code stands behind '#', so a browser sends it to nobody."""
    return f"{address}join#{code}"


def qr_svg(text: str) -> str:
    """Return a QR code as an SVG file, black on white with its margin."""
    drawn = io.BytesIO()
    segno.make(text, error="m").save(drawn, kind="svg", xmldecl=False, scale=8, light="#fff", border=4)
    return drawn.getvalue().decode()


def qr_for_terminal(text: str) -> str:
    """Return a QR code of half blocks, for a terminal; light on dark and dark on light both can be scanned."""
    drawn = io.StringIO()
    segno.make(text, error="l").terminal(drawn, border=2, compact=True)
    return drawn.getvalue().rstrip("\n")


def class_keys(folder: Path, hosts: Sequence[str], now: datetime) -> tuple[Path, Path]:
    """Return the files of a class's HTTPS: the server's secret keys, and the authority's certificate for tablets.

    The keys are for ``motorcade.local`` and these addresses; they are made where they aren't there or end soon.
    The authority stays when the addresses change, so a tablet that trusts it goes on to do so. Raises MotorcadeError,
    or OSError where the folder can't be written to.
    """
    digest = hashlib.sha256(" ".join(sorted(hosts)).encode()).hexdigest()[:8]
    kept = folder / f"class-{digest}.pem"
    try:
        is_good = x509.load_pem_x509_certificate(read_bytes(kept)).not_valid_after_utc >= now + _LEAST
    except (OSError, ValueError, InputError):
        is_good = False
    if not is_good:
        made = folder / f"{CAR}-{_NAME}.pem"
        made.unlink(missing_ok=True)
        make_keys(folder, [CarKeys(_NAME, tuple(hosts))], [], now)
        made.replace(kept)
    return kept, folder / AUTHORITY_PUBLIC
