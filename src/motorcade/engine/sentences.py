"""What can be wrong with a mat or a world: stable codes, and their sentences in English and Chinese."""

# The words in braces are filled in per case: {place}, {who} and the like name a part of the mat as its file does.
MAT: dict[str, dict[str, str]] = {
    "no-cars": {
        "en": "there are no cars; add a [[car]] or a [[crowd]]",
        "zh": "没有小车；请添加 [[car]] 或 [[crowd]]",
    },
    "start-out-of-range": {
        "en": "the {name} of {who} is {value:g}; allowed: -{most:g} to {most:g}",
        "zh": "{who}的{name}是 {value:g}；允许范围：-{most:g} 到 {most:g}",
    },
    "over-the-edge": {
        "en": "{who} starts at [{x:g}, {y:g}], over the mat's edge; a car's body is {diameter:g} m across, "
        "so keep its centre {inside:g} m inside",
        "zh": "{who}的起点 [{x:g}, {y:g}] 超出场地边缘；车身直径 {diameter:g} 米，中心应在边缘以内 {inside:g} 米",
    },
    "on-something": {
        "en": "{who} starts at [{x:g}, {y:g}], on {place}; a car's body is {diameter:g} m across, so move one of them",
        "zh": "{who}的起点 [{x:g}, {y:g}] 与 {place} 重叠；车身直径 {diameter:g} 米，请移开其中一个",
    },
    "too-close": {
        "en": "{who} starts at [{x:g}, {y:g}], {apart:g} m from {other}; a car's body is {diameter:g} m across, "
        "so move them apart, or give a crowd more spacing_m",
        "zh": "{who}的起点 [{x:g}, {y:g}] 距{other}只有 {apart:g} 米；车身直径 {diameter:g} 米，"
        "请把它们分开，或加大车群的 spacing_m",
    },
    "lengths-differ": {
        "en": "x_m, y_m, heading and leads differ in length; give each of them one value per car",
        "zh": "x_m、y_m、heading 和 leads 的长度不同；每辆小车各需要一个值",
    },
    "too-many-cars": {
        "en": "there are {count} cars in all; allowed: up to {most}",
        "zh": "共有 {count} 辆小车；最多允许 {most} 辆",
    },
    "no-area": {
        "en": "{place} has no area and the mat no size_m; give the crowd its corner_m and size_m",
        "zh": "{place} 没有区域，场地也没有 size_m；请为车群设置 corner_m 和 size_m",
    },
    "too-many-leaders": {
        "en": "{place}.leaders is {leaders}; allowed: up to {cars}, as many as its cars",
        "zh": "{place}.leaders 是 {leaders}；不能超过车群的小车数 {cars}",
    },
    "no-room": {
        "en": "{place} finds room for {free} of its {cars} cars on {width:g} x {height:g} m, {spacing:g} m apart; "
        "lower cars or spacing_m, or give it a larger or emptier area",
        "zh": "{place} 在 {width:g} x {height:g} 米内、间距 {spacing:g} 米时，{cars} 辆小车只放得下 {free} 辆；"
        "请减小 cars 或 spacing_m，或换一个更大、更空的区域",
    },
    "bad-ending": {
        "en": "a mat's file ends in .toml or .json; rename it, or name another file",
        "zh": "场地文件以 .toml 或 .json 结尾；请改名，或选择其他文件",
    },
    "unreadable": {
        "en": "the file can't be read: {reason}",
        "zh": "无法读取文件：{reason}",
    },
    "brackets": {
        "en": "brackets are nested too deep; take some away",
        "zh": "括号嵌套过深；请去掉一些",
    },
    "syntax": {
        "en": "this is not {kind}: {reason}",
        "zh": "这不是 {kind}：{reason}",
    },
    "no-object": {
        "en": "this is no object; begin it with {{ and its keys",
        "zh": "这不是对象；请以 {{ 和它的键开头",
    },
    "unknown-key": {
        "en": "{place} is not known; known are {known}",
        "zh": "不认识 {place}；可用的有 {known}",
    },
    "missing-key": {
        "en": "{place} is missing, {title}; give {allowed}",
        "zh": "缺少 {place}；请给出{allowed}",
    },
    "not-allowed": {
        "en": "{place} is {value}; allowed: {allowed}",
        "zh": "{place} 是 {value}；允许：{allowed}",
    },
    "nested-too-deep": {
        "en": "{place} is nested too deep; take the inner brackets away",
        "zh": "{place} 嵌套过深；请去掉里面的括号",
    },
    "unusual-number": {
        "en": "{place} is {value}; give a number of usual size",
        "zh": "{place} 是 {value}；请给出大小正常的数",
    },
    "unusual-value": {
        "en": "{place} is {value}; allowed: numbers, text, lists, tables, true and false",
        "zh": "{place} 是 {value}；允许：数、文字、列表、表、true 和 false",
    },
    "unprintable": {
        "en": "{place} holds characters that can't be shown; leave them out",
        "zh": "{place} 含有无法显示的字符；请去掉",
    },
    "edge-without-size": {
        "en": "edge is a wall but there is no size_m; give the mat's width and height",
        "zh": "边缘是墙，却没有 size_m；请给出场地的宽和高",
    },
    "no-length": {
        "en": "{place} has no length; give two different points, 1 mm apart or more",
        "zh": "{place} 没有长度；请给出相距至少 1 毫米的两个点",
    },
    "same-corners": {
        "en": "{place} has corners {one} and {other} at one place; leave one of them out",
        "zh": "{place} 的拐角 {one} 和 {other} 在同一处；请去掉一个",
    },
    "flat": {
        "en": "{place} has no area; move its corners apart",
        "zh": "{place} 没有面积；请把拐角分开",
    },
    "crossing": {
        "en": "{place} meets itself where its sides {one} and {other} touch or cross; "
        "list its corners in order round it",
        "zh": "{place} 的边 {one} 和 {other} 相接或相交；请按顺序沿外围列出拐角",
    },
    "late-begin": {
        "en": "{place} is at {time:g} s; begin the path at 0 s",
        "zh": "{place} 的时间是 {time:g} 秒；路径应从 0 秒开始",
    },
    "times-not-rising": {
        "en": "{place} is at {time:g} s, after {before:g} s; let times rise, by 0.001 s or more",
        "zh": "{place} 的时间是 {time:g} 秒，而前一个是 {before:g} 秒；时间应递增，每次至少 0.001 秒",
    },
}
