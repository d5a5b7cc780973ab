"""The service behind the page, without HTTP: requests, a simulated world, uploads, storage."""
