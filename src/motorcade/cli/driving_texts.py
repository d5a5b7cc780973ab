"""What commands of drivers and driven cars say on a terminal, in English and Chinese."""

# A car's states, as telemetry names them.
STATES = {
    "en": {
        "ready": "ready",
        "standing": "standing",
        "moving": "moving",
        "failsafe": "stopped by itself",
        "stopped": "EMERGENCY STOP",
        "program": "runs its program",
    },
    "zh": {
        "ready": "就绪",
        "standing": "停住",
        "moving": "行驶中",
        "failsafe": "已自动停下",
        "stopped": "紧急停止",
        "program": "正在运行程序",
    },
}

# Of a car that is served; the words in braces are filled in per case.
SERVED = {
    "en": {
        "serves": "The car takes commands at {host} port {port}, telemetry is at {telemetry_port}.{more} Ctrl-C ends.",
        "uploads": " It takes uploads at {address}.",
        "page": " Its page is {url}",
        "stands": "The car stands still.",
        "drives": "{state}; {driver} drives",
        "nobody": "{state}; nobody drives",
        "fault": "{told}; {fault}",
        "image": "took an image of {bytes} bytes",
        "open": "Everybody who reaches {host} may drive this car, and nothing that is sent is secret: --insecure-lan",
        "no-keys": "at {host} others can reach this car: give it keys, --keys car-….pem (`motorcade drive keys` makes "
        "them), or let everybody drive it with --insecure-lan",
        "open-uploads": "at {host} others can reach this car's uploads, and uploads know no keys: take them at "
        "127.0.0.1 or by --upload-serial, or let everybody in with --insecure-lan",
        "keys-and-lan": "--keys and --insecure-lan exclude each other: with keys nobody else gets in",
        "pins": "a real car needs its pin file, --pins, and a simulated one has none",
        "simulated-only": "--mat and --program are for simulated cars; a real one runs what was uploaded to it",
        "real-only": "--role, --number, --upload-serial, --upload-tcp, --store and --voice are for real cars; "
        "a simulated one leads, and runs --program",
        "two-lines": "--upload-serial and --upload-tcp exclude each other",
        "one-keyboard": "--voice keyboard and --stick keyboard exclude each other: there is one keyboard",
    },
    "zh": {
        "serves": "小车在 {host} 的端口 {port} 接收指令，遥测在端口 {telemetry_port}。{more} 按 Ctrl-C 结束。",
        "uploads": "在 {address} 接收上传。",
        "page": "网页：{url}",
        "stands": "小车已停住。",
        "drives": "{state}；{driver} 在驾驶",
        "nobody": "{state}；无人驾驶",
        "fault": "{told}；{fault}",
        "image": "已接收映像，共 {bytes} 字节",
        "open": "能访问 {host} 的任何人都可以驾驶这辆小车，传输内容均不加密：--insecure-lan",
        "no-keys": "其他人能通过 {host} 访问这辆小车：请用 --keys car-….pem 设置密钥"
        "（由 `motorcade drive keys` 生成），或用 --insecure-lan 允许任何人驾驶",
        "open-uploads": "其他人能通过 {host} 向这辆小车上传，而上传不使用密钥：请改在 127.0.0.1 或用 --upload-serial "
        "接收上传，或用 --insecure-lan 允许任何人上传",
        "keys-and-lan": "--keys 与 --insecure-lan 不能同时使用：有密钥时，其他人无法连接",
        "pins": "真实小车需要引脚文件 --pins，模拟小车没有引脚文件",
        "simulated-only": "--mat 和 --program 只用于模拟小车；真实小车运行上传给它的程序",
        "real-only": "--role、--number、--upload-serial、--upload-tcp、--store 和 --voice 只用于真实小车；"
        "模拟小车是主机，运行 --program 的程序",
        "two-lines": "--upload-serial 与 --upload-tcp 不能同时使用",
        "one-keyboard": "--voice keyboard 与 --stick keyboard 不能同时使用：只有一个键盘",
    },
}
