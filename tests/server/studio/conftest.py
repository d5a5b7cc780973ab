"""A studio: its server without a socket, and in a process of its own."""

import pytest

from support.running_studio import started
from support.world_page import server


@pytest.fixture
def client(tmp_path):
    with server(tmp_path) as served:
        yield served


@pytest.fixture(scope="module")
def studio(tmp_path_factory):
    with started(tmp_path_factory.mktemp("library")) as running:
        yield running
