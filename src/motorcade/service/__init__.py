"""The studio: the page's server. It compiles, simulates and uploads what the page's blocks say."""
