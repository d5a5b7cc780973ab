"""Ports for pyserial beside its own: ``serial.protocol_handler_packages`` names this package."""
