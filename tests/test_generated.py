"""Generated files say what they should. `make stale` tells whether they are up to date."""

import json
from pathlib import Path

ROOT = Path(__file__).parent.parent


def test_the_schema_accepts_the_example_and_refuses_a_misspelt_key():
    import jsonschema_rs

    schema = json.loads((ROOT / "docs" / "motorcade-program-1.schema.json").read_text(encoding="utf-8"))
    project = json.loads((ROOT / "examples" / "parade.motorcade.json").read_text(encoding="utf-8"))
    assert jsonschema_rs.is_valid(schema, project)
    project["leeder"] = project.pop("leader")
    assert not jsonschema_rs.is_valid(schema, project)
