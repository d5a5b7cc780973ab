"""What is allowed in a part of a mat: in English as its schema describes it, in Chinese told from its bounds."""

from motorcade.mats.schema import Schema

_POINTS = {2: "[x, y]", 3: "[t_s, x, y]"}


def allowed(part: Schema) -> dict[str, str]:
    """What may stand where ``part`` is the schema, by language. Lengths are in metres, times in seconds."""
    return {"en": part["description"], "zh": _chinese(part)}


def _chinese(part: Schema) -> str:
    if "enum" in part:
        return "或".join(f' "{each}" ' for each in part["enum"])
    match part["type"]:
        case "boolean":
            return " true 或 false "
        case "integer":
            return f" {part['minimum']} 到 {part['maximum']} 的整数"
        case "number":
            least = part.get("minimum", part.get("exclusiveMinimum"))
            over = "（不含）" if "exclusiveMinimum" in part else ""
            return f" {least}{over} 到 {part['maximum']} 的数"
        case "string":
            return f"一行 {part['minLength']} 到 {part['maxLength']} 个字符的文字"
        case "array":
            return _chinese_list(part)
        case "object":
            return f"由 {', '.join(part['properties'])} 组成的表"
        case _:
            return f' {part["minimum"]} 到 {part["maximum"]} 的数，或 "random"'


def _chinese_list(part: Schema) -> str:
    items = part["items"]
    if items["type"] == "number":
        name = "[x, y]" if items["minimum"] < 0 else "[宽, 高]"
        return f" {name}，每个值为 {items['minimum']} 到 {items['maximum']}"
    if items["type"] == "object":
        return "由表组成的列表"
    bounds = "，".join(f"{name} 为 {least} 到 {most}" for name, least, most in _bounds(items))
    return f"由 {part['minItems']} 到 {part['maxItems']} 个 {_POINTS[items['minItems']]} 组成的列表，{bounds}"


def _bounds(point: Schema) -> list[tuple[str, float, float]]:
    """The name and the range of each number of a point."""
    times = [("t_s", each["minimum"], each["maximum"]) for each in point.get("prefixItems", ())]
    return [*times, ("x 和 y", point["items"]["minimum"], point["items"]["maximum"])]
