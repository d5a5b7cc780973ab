"""Files that people write: profiles, pin files, voice maps, formats of one's own."""
