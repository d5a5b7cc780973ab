"""The service behind the page, without HTTP: requests, a simulated world, uploads, storage.

A shell runs it and connects it to the page: a server, or a worker in the browser of the page.
"""
