"""A mock of the windows of Matplotlib, as a backend: it counts how often a picture is drawn in a window."""

from matplotlib.backend_bases import FigureManagerBase
from matplotlib.backends.backend_agg import FigureCanvasAgg

shown = 0


class FigureManager(FigureManagerBase):
    """A window, which is open until it is destroyed."""

    def show(self) -> None:
        """Open it."""


class FigureCanvas(FigureCanvasAgg):
    """A canvas in a window. Matplotlib takes it where there is no display, too."""

    manager_class = FigureManager
    required_interactive_framework = "headless"

    def flush_events(self) -> None:
        """Let the window draw."""
        global shown
        shown += 1
