"""Write captures for tshark: the classic pcap format, and TCP segments in IPv4."""

import struct
from collections.abc import Iterable
from pathlib import Path

RAW_IP, USER0 = 101, 147
_HOST, _CAR = bytes([10, 0, 0, 1]), bytes([10, 0, 0, 2])


def write_pcap(path: Path, link_type: int, packets: Iterable[bytes]) -> None:
    """Writes ``packets``, a millisecond apart."""
    data = struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 1 << 16, link_type)
    for number, packet in enumerate(packets):
        data += struct.pack("<IIII", 1_500_000_000, number * 1000, len(packet), len(packet)) + packet
    path.write_bytes(data)


def segments(pieces: Iterable[bytes], port: int, client_port: int = 40_000, answers: bool = False) -> list[bytes]:
    """One TCP segment for each of ``pieces``, from a client to ``port``, or from there where it ``answers``."""
    source, destination = (port, client_port) if answers else (client_port, port)
    ends = _CAR + _HOST if answers else _HOST + _CAR
    packets, sequence = [], 1
    for piece in pieces:
        # Data offset 5 words; flags PSH and ACK; a window; no checksum, which tshark leaves unchecked.
        tcp = struct.pack(">HHIIHHHH", source, destination, sequence, 1, 5 << 12 | 0x18, 1 << 14, 0, 0) + piece
        # Version 4, 5 words of header; don't fragment; 64 hops; TCP.
        ip = struct.pack(">BBHHHBBH", 0x45, 0, 20 + len(tcp), 0, 0x4000, 64, 6, 0) + ends
        packets.append(ip + tcp)
        sequence += len(piece)
    return packets
