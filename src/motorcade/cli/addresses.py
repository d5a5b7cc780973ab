"""Addresses that users type."""

from motorcade.cli.failures import UsageError
from motorcade.cli.options import whole_number


def host_and_port(address: str) -> tuple[str, int]:
    """The host and the port in ``HOST:PORT``; an IPv6 address may stand in brackets. Raises UsageError."""
    host, colon, port = address.rpartition(":")
    host = host.strip("[]")
    number = whole_number(port, "the port") if colon else -1
    if not host or not 0 <= number <= 65535:
        raise UsageError(f"'{address}' is not HOST:PORT, such as 127.0.0.1:7000")
    return host, number
