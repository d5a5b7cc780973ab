"""Everything that a page may ask for, without HTTP: requests, a world in play, uploads, storage."""
