"""The promises that the simulated room tries: their words in the documentation, how they are checked, how often.

``python -m tests.faults --promises LANGUAGE`` runs the seeds of ``make test`` and prints the table of docs/security.md.
"""

from collections.abc import Mapping
from typing import NamedTuple

BEGIN, END = "<!-- python -m tests.faults --promises -->", "<!-- end -->"
# The first hundred seeds, and those that notice a break of broken_places.py which none of these notices.
SEEDS: dict[str, tuple[int, ...]] = {
    "uploads": (*range(100), 100, 122),
    "driving": (*range(100), 157),
    "fleet": (*range(100), 147, 159),
    "class": (*range(100),),
}
# The documents that have the words.
DOCUMENTS = ("security", "uploads", "drive", "cars")
HEADS = {
    "en": ("promise", "each time the clock moves in a run", "tried"),
    "zh": ("承诺", "时钟每走一步之后检查", "次数"),
}
# What is done in the runs, by the names that they count.
FAULTS = {
    "kill": ("kills", "次终止"),
    "power failure": ("power failures", "次断电"),
    "full disk": ("full disks", "次磁盘满"),
    "disk error": ("errors of disks", "次磁盘出错"),
    "cut": ("cut connections", "次断开连接"),
    "half-open": ("half-open connections", "次半开连接"),
    "stall": ("stalls of a network", "次网络停顿"),
    "pulled cable": ("pulled cables", "次拔线"),
    "freeze": ("frozen programs", "次程序冻结"),
    "busy loop": ("busy loops", "次事件循环繁忙"),
    "guard": ("hurt guards", "次守护进程受损"),
    "hardware fails": ("faults of a car's hardware", "次小车硬件故障"),
    "hardware hangs": ("hangs of it", "次硬件卡住"),
    "stranger": ("strangers", "个陌生人"),
}


class Promise(NamedTuple):
    """A promise.

    Attributes:
        names: by which scenarios try it, with the scenario before a colon.
        words: in English and Chinese, as the documents have them.
        checks: how it is checked, in both languages.
    """

    names: tuple[str, ...]
    words: tuple[str, str]
    checks: tuple[str, str]


PROMISES = (
    Promise(
        ("uploads:image-whole", "class:class-whole", "uploads:no-rubbish"),
        (
            "a full disk or a killed process leaves the old recording, image, project or keys",
            "磁盘已满或进程被终止时，旧的记录、映像、项目或密钥仍在",
        ),
        (
            "whatever of what was written a power failure would keep now, the file is an old one or the new one, whole",
            "无论此刻断电会保留哪些已写的字节和名字，文件都是完整的旧文件或新文件",
        ),
    ),
    Promise(
        ("uploads:acknowledged-stays", "uploads:verified"),
        (
            "The upload ends with *verified* only if that is the checksum of the image that was sent",
            "只有它与所发映像的校验和相同时，上传才以 verified（已校验）结束",
        ),
        (
            "the car has stored it, and once the answer has left no power failure takes it away",
            "小车已经保存它，答复发出之后，断电也不会使它丢失",
        ),
    ),
    Promise(
        ("uploads:says-what-it-holds", "uploads:upload-ends", "uploads:goes-on"),
        (
            "The sentence of each failure includes what to do and what the car holds now",
            "每种失败的说明都包含该怎么办，以及小车现在存有什么",
        ),
        (
            "it holds that; each upload ends within 90 s; when all faults have ended, the next one is verified",
            "小车确实存着它；每次上传在 90 秒内结束；故障全部结束后，下一次上传成功校验",
        ),
    ),
    Promise(
        ("driving:stands-in-time", "driving:gone-stops"),
        ("without a fresh command the wheels stop within 300 ms", "没有新指令时，车轮在 300 毫秒内停下"),
        (
            "300 ms after the last command; 330 ms where the server is killed or frozen; at once after a driver left",
            "最后一条指令之后 300 毫秒；服务被终止或冻结时，最后一条指令之后 330 毫秒；驾驶者离开之后立即停下",
        ),
    ),
    Promise(
        ("driving:guarded",),
        ("a car whose guard is killed or frozen stops too", "守护进程被终止或冻结时，小车也停下"),
        ("no command moves it until its server has started again", "服务重新启动之前，没有指令使它移动"),
    ),
    Promise(
        ("driving:no-old-command", "driving:sent"),
        (
            "commands that the network delivers late move nothing after a stall of any length",
            "网络停顿无论多久，也包括与连接同时开始的停顿，迟到的指令如果带时间戳，就不能使小车移动",
        ),
        (
            "the age of each command that moves the wheels, against the fastest of its connection",
            "每条移动车轮的指令的延迟，与同一连接中最快的指令比较",
        ),
    ),
    Promise(
        ("driving:stop-gets-through", "driving:stop-holds"),
        ("everybody who can connect can stop the car at once", "每个能连接的人都能立即停住小车"),
        (
            "a stop is answered within 0.2 s, a newcomer's within 1 s; then nothing moves until somebody lifts it",
            "停止在 0.2 秒内得到答复，新来的人在 1 秒内；然后在有人解除之前，什么都不动",
        ),
    ),
    Promise(
        ("driving:one-driver", "driving:leaves-standing", "driving:drives-again"),
        ("There is one driver", "驾驶者只有一个"),
        (
            "no other command moves the car before the driver leaves, is silent or is asked; at the end one can drive",
            "驾驶者离开、沉默或被请求之前，别人的指令不使小车移动；最后想驾驶的人都能驾驶",
        ),
    ),
    Promise(
        ("driving:armed", "driving:held-stick"),
        (
            "A stick that is held while its connection breaks moves nothing until it is released",
            "仍被推着的摇杆，松手之前不会使小车移动",
        ),
        (
            "after a stop by itself a command with speed 0 comes first, also from a client of 2018",
            "小车自己停下之后，先要有一条速度为 0 的指令，2018 年的客户端也一样",
        ),
    ),
    Promise(
        ("driving:horn-ends",),
        ("a horn ends within 300 ms of the last command", "喇叭在最后一条指令后 300 ms 内停止"),
        (
            "from when that was sent, with the longest delay that a command may have",
            "从发送时算起，加上指令允许的最大延迟",
        ),
    ),
    Promise(
        ("fleet:image-whole", "fleet:verified", "fleet:says-what-it-holds"),
        (
            "If the uploader is killed, each car holds the old program or the new one, whole",
            "如果上传程序被强行结束，每辆小车都存有完整的旧程序或新程序",
        ),
        (
            "whatever of what was written a power failure would keep now; each car holds what its verdict says",
            "无论此刻断电会保留哪些已写的内容；每辆小车存有的正是它的结果所说的",
        ),
    ),
    Promise(
        ("fleet:stop-gets-through", "fleet:stop-holds", "fleet:away-first"),
        ("Cars that are away get the last order first when they are back", "离开的小车回来时最先收到最后一次命令"),
        (
            "the first bytes of each connection; all others stand within 0.3 s, also while they are loaded, until *go*",
            "每个连接最先发送的字节；其他小车在 0.3 秒内停下，正在上传时也是，直到 *go*",
        ),
    ),
    Promise(
        ("fleet:nobody-waits", "fleet:found", "fleet:goes-on"),
        ("no car waits for one that is away", "没有小车要等待离开的小车"),
        (
            "each healthy car has a new program within 4 s; at the end all are found, stopped and loaded",
            "每辆正常的小车在 4 秒内得到新程序；最后所有小车都被找到、停下并得到程序",
        ),
    ),
    Promise(
        ("class:answered-stays", "class:in-the-class", "class:class-goes-on"),
        (
            "a killed server of a class loses nothing that it has answered",
            "班级服务器被终止时，已经答复的内容都不会丢失",
        ),
        (
            "membership, names, drafts and projects, after kills and power failures; at the end everybody works again",
            "成员、名字、草稿和项目，在终止和断电之后；最后所有人都能继续",
        ),
    ),
    Promise(
        ("class:work-of-others", "class:own-view", "class:teacher-only"),
        (
            "a pupil reaches no address of the teacher, no project, draft or world of another",
            "学生访问不了老师的任何地址，访问不了别人的作品、草稿和世界",
        ),
        ("all bytes that a pupil's browser gets", "学生浏览器收到的所有字节"),
    ),
    Promise(
        ("class:stop-gets-through",),
        ("reading, signing in, stopping and freezing work", "读取、登录、停车和冻结都有效"),
        (
            "pupils see a stop within 1 s, also where the disk is full or slow",
            "学生在 1 秒内看到停止，磁盘已满或很慢时也是",
        ),
    ),
    Promise(
        ("class:connections-bounded", "class:memory-bounded", "driving:connections-bounded", "driving:memory-bounded"),
        ("connections are bounded in all (512) and by address", "连接总数（512）和每个地址"),
        (
            "accepted connections, of a car too (64 for each port), and the bytes that wait for whoever doesn't read",
            "已接受的连接，小车也是（每个端口 64 个），以及等待不读取者的字节",
        ),
    ),
    Promise(
        ("class:strangers-stay-out", "class:no-traceback"),
        ("a request that is broken off leaves no traceback", "中断的请求不会在日志中留下回溯"),
        (
            "no program of a run ends in an error that it doesn't handle, logs one, or lets a stranger in",
            "没有程序因未处理的错误而结束，没有把错误写入日志，也没有放陌生人进来",
        ),
    ),
)


def rounded(count: int) -> int:
    """A count without its third digit and those behind it."""
    factor = 10 ** max(0, len(str(count)) - 2)
    return count // factor * factor


def table(language: str, tried: Mapping[str, int], counts: Mapping[str, int]) -> str:
    """The table of the documentation.

    Args:
        language: "en" or "zh".
        tried: how often each promise was tried, by its name with its scenario.
        counts: how often each fault was made.
    """
    at = ("en", "zh").index(language)
    made = [f"{rounded(counts[name]):,} {FAULTS[name][at]}" for name in FAULTS if counts.get(name)]
    runs = sum(map(len, SEEDS.values()))
    if language == "en":
        lead = f"In {runs} runs of the scenarios there are {', '.join(made)}:"
    else:
        lead = f"这些情景共运行 {runs} 次，其中有 {'、'.join(made)}："
    rows = [HEADS[language], ("---", "---", "---")]
    for promise in PROMISES:
        count = rounded(sum(tried.get(name, 0) for name in promise.names))
        rows.append((promise.words[at], promise.checks[at], f"{count:,}"))
    return "\n".join([lead, "", *(f"| {' | '.join(row)} |" for row in rows)])
