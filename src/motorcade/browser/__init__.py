"""The shell of the studio that runs in a browser: `motorcade.service` under Pyodide, in a worker."""
