"""pyserial's lines to TCP ports, such as ``socket://127.0.0.1:7000``, without their pauses."""

import socket
from types import SimpleNamespace

from serial.urlhandler import protocol_socket


def without_pauses(monkeypatch):
    """Keep pyserial from sleeping 0.3 s at each close, and the kernel from holding back small pieces for 40 ms."""
    connect = socket.create_connection

    def connect_without_delay(*arguments, **options):
        line = connect(*arguments, **options)
        line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return line

    monkeypatch.setattr(protocol_socket, "time", SimpleNamespace(sleep=lambda seconds: None))
    monkeypatch.setattr(socket, "create_connection", connect_without_delay)
