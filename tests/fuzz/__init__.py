"""Programs that fuzz what comes from others: `tests/README.md` says how to run them."""
