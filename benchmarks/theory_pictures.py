"""Print and draw the experiments of theory.py: ``python benchmarks/theory_pictures.py --pictures docs/lab``."""

import argparse
import time
import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from theory import CRITICAL_NEIGHBOURS, EXPERIMENTS, Series

# Of a normal distribution: 95% lie within so many standard deviations.
NORMAL_95 = 1.96
COLOURS = ("C0", "C3")
TEXTS: dict[str, dict[str, str]] = {
    "": {
        "aloha": "Offered load|Throughput",
        "percolation": "Mean number of cars within range|Share of followers that get the word",
        "epidemic": "Time, in mean times between two contacts of a car|Share of cars that have the word",
        "diffusion": "Angle of a turn, degrees|Coefficient of diffusion, m²/s",
        "trickle": "Followers in the cell|Messages in an interval",
        "any-time": "frames begin at any ms",
        "any-time-limit": "ALOHA",
        "half-frames": "frames begin at whole half frames",
        "half-frames-limit": "ALOHA with such steps",
        "word": "a word",
        "word-limit": "clusters of the same places",
        "critical": "discs percolate",
        "rare": "a car tells the word every 4 s",
        "rare-limit": "logistic",
        "often": "every second",
        "wanders": "wandering cars",
        "wanders-limit": "run and tumble, long times",
        "few-lost": "10% of frames are lost",
        "few-lost-limit": "logarithm",
        "half-lost": "50%",
        "theory": "theory",
    },
    ".zh": {
        "aloha": "提供的负载|吞吐量",
        "percolation": "红外范围内小车的平均数|得到码字的跟车比例",
        "epidemic": "时间（以一辆车两次接触之间的平均时间为单位）|持有码字的小车比例",
        "diffusion": "一次转弯的角度（度）|扩散系数（平方米/秒）",
        "trickle": "一个小区里的跟车数|一个区间里的消息数",
        "any-time": "帧可在任意毫秒开始",
        "any-time-limit": "ALOHA",
        "half-frames": "帧在半帧的整数倍时刻开始",
        "half-frames-limit": "这种步长的 ALOHA",
        "word": "码字",
        "word-limit": "同一组位置的连通簇",
        "critical": "圆盘渗流阈值",
        "rare": "每辆车平均 4 秒说一次",
        "rare-limit": "逻辑斯谛",
        "often": "平均每秒一次",
        "wanders": "漫游的小车",
        "wanders-limit": "跑动与翻滚，长时间",
        "few-lost": "丢失 10% 的帧",
        "few-lost-limit": "对数",
        "half-lost": "丢失 50%",
        "theory": "理论",
    },
}
# Limits that are drawn: those of one of several series say the same.
DRAWN = ("any-time-limit", "half-frames-limit", "word-limit", "rare-limit", "wanders-limit", "few-lost-limit")


def draw(folder: Path, name: str, found: Sequence[Series]) -> None:
    """Draw an experiment in each language: points with 95% confidence intervals, and theory as lines."""
    import matplotlib as mpl
    from matplotlib import pyplot as plt

    # Text stays text, so every browser shows it in a font of its own; the font used here may lack Chinese.
    warnings.filterwarnings("ignore", message="Glyph")
    mpl.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "motorcade", "font.size": 9, "axes.grid": True})
    for suffix, texts in TEXTS.items():
        figure, axes = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
        for colour, each in zip(COLOURS, found, strict=False):
            order, bars = np.argsort(each.x), NORMAL_95 * each.error
            axes.errorbar(each.x, each.mean, bars, fmt="o", ms=4, capsize=3, color=colour, label=texts[each.key])
            axes.plot(each.x[order], each.theory[order], color=colour, label=texts["theory"])
            for key, values in each.limits.items():
                if key in DRAWN:
                    axes.plot(each.x[order], values[order], ":", color=colour, label=texts[key])
        if name == "percolation":
            axes.axvline(CRITICAL_NEIGHBOURS, color="k", lw=0.8, ls="--", label=texts["critical"])
        if name == "trickle":
            axes.set_xscale("log", base=2)
        if name == "diffusion":
            axes.set_yscale("log")
        along, up = texts[name].split("|")
        axes.set(xlabel=along, ylabel=up)
        axes.legend()
        figure.savefig(folder / f"{name}{suffix}.svg", metadata={"Date": None})
        plt.close(figure)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("experiments", nargs="*", metavar="EXPERIMENT", help=", ".join(EXPERIMENTS))
    parser.add_argument("--pictures", type=Path, metavar="FOLDER")
    arguments = parser.parse_args()
    for name in arguments.experiments or EXPERIMENTS:
        begin_s = time.perf_counter()
        found = EXPERIMENTS[name]()
        print(f"{name}: {time.perf_counter() - begin_s:.0f} s")
        for each in found:
            print(f"  {TEXTS[''][each.key]}: place, mean ± 95% interval, theory")
            for x, mean, error, theory in zip(each.x, each.mean, each.error, each.theory, strict=True):
                print(f"    {x:8.3f}  {mean:8.4f} ± {NORMAL_95 * error:.4f}  {theory:8.4f}")
        if arguments.pictures:
            draw(arguments.pictures, name, found)


if __name__ == "__main__":
    main()
