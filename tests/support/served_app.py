"""A server at a real socket, in a thread of its own."""

import asyncio
import socket
import threading
from contextlib import contextmanager

from motorcade.server.request_filter import ServerSettings
from motorcade.server.running import serving
from support.waiting import DEADLINE_S


@contextmanager
def served(make_app, tls=None):
    """Serve what ``make_app``, called in the event loop, makes; give its address."""
    begun, ended, loop = threading.Event(), asyncio.Event(), asyncio.new_event_loop()
    listener = socket.create_server(("127.0.0.1", 0))

    async def serve():
        async with serving(make_app(), ServerSettings(), listener, tls):
            begun.set()
            await ended.wait()

    thread = threading.Thread(target=loop.run_until_complete, args=(serve(),))
    thread.start()
    try:
        assert begun.wait(DEADLINE_S)
        yield listener.getsockname()
    finally:
        loop.call_soon_threadsafe(ended.set)
        thread.join(DEADLINE_S)
        loop.close()
