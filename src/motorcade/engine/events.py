"""What happens to cars, as rows of one array: light enough for those who only read a recording."""

import numpy as np

# kind is an index into KINDS and why one into LOSS_REASONS. word is the control word, for a lost frame the bits on
# the air. other is a state's index, or the number of a frame's sender, else 0.
EVENT = np.dtype(
    [
        ("t_ms", "<u4"),
        ("world", "<u4"),
        ("car", "<u4"),
        ("kind", "u1"),
        ("why", "u1"),
        ("word", "<u4"),
        ("other", "<u4"),
    ]
)
KINDS = ("state", "start", "over", "frame", "heard", "lost")
LOSS_REASONS = ("", "parity", "reserved", "deaf", "sending", "collision")
