"""Files that people write: profiles, pin files, voice maps; and the check of every such file."""
