"""Where the engine spends its time: the benchmark problem under a sampling profiler, drawn as a flame graph.

The kernel is one function after inlining; the line tables tell what was inlined where. Needs Linux `perf` and
binutils' `addr2line`. Run by `make profile`; writes target/profile/flame.svg.
"""

import collections
import html
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
OUT = ROOT / "target" / "profile"
WIDTH, HEIGHT, DEPTH = 1400, 18, 16  # of the picture, of a frame, frames deep
PROGRAM = """
import problem
rows = problem.columns(8192)
for _ in range(20):
    problem.sweep(rows, rtol=1e-6, threads=1)
"""
Stacks = collections.Counter[tuple[str, ...]]


def recorded(extension: str) -> list[int]:
    """Addresses inside the extension at which samples fell."""
    data = OUT / "perf.data"
    record = ["perf", "record", "-q", "-e", "cpu-clock", "-F", "2000", "--call-graph", "fp", "-o", str(data)]
    subprocess.run([*record, sys.executable, "-c", PROGRAM], check=True, cwd=ROOT / "benches")
    script = ["perf", "script", "-i", str(data), "-F", "ip,sym,dso"]
    chains = subprocess.run(script, check=True, capture_output=True, text=True).stdout.strip("\n").split("\n\n")
    leaves = [chain.strip("\n").splitlines()[0] for chain in chains if chain.strip()]
    offset = shift(extension)
    return [int(leaf.split()[0], 16) + offset for leaf in leaves if f"({extension})" in leaf]


def named(addresses: list[int], extension: str) -> Stacks:
    """Stacks of inlined functions, outermost first, with their number of samples."""
    counts = collections.Counter(addresses)
    tool = ["addr2line", "-a", "-f", "-i", "-C", "-e", extension]
    asked = "\n".join(hex(address) for address in counts)
    told = subprocess.run(tool, input=asked, check=True, capture_output=True, text=True).stdout
    stacks: Stacks = collections.Counter()
    for block in re.split(r"^(?=0x)", told, flags=re.MULTILINE)[1:]:
        address, *lines = block.splitlines()
        names = tuple(short(line) for line in reversed(lines[::2]))
        stacks[names] += counts[int(address, 16)]
    return stacks


def shift(extension: str) -> int:
    """From offsets in the file, which perf tells, to the addresses that the line tables use."""
    headers = subprocess.run(["readelf", "-lW", extension], check=True, capture_output=True, text=True).stdout
    code = next(line.split() for line in headers.splitlines() if line.split()[:1] == ["LOAD"] and " R E " in line)
    return int(code[2], 16) - int(code[1], 16)


def short(name: str) -> str:
    """A function's name without path and types."""
    while (bare := re.sub(r"<[^<>]*>", "", name)) != name:
        name = bare
    return next((part for part in reversed(name.split("::")) if part and "{" not in part), "?")


def frames(stacks: Stacks, depth: int = 0, left: float = 0.0, share: float = 1.0) -> list[str]:
    """SVG of all frames from a depth on; widths are shares of the samples."""
    total = sum(stacks.values())
    groups: dict[str, Stacks] = {}
    for stack, count in stacks.items():
        if len(stack) > depth:
            groups.setdefault(stack[depth], collections.Counter())[stack] += count
    drawn = []
    for name, group in sorted(groups.items(), key=lambda item: -sum(item[1].values())):
        width = share * sum(group.values()) / total
        if width * WIDTH < 1 or depth >= DEPTH:
            continue
        x, y, w = left * WIDTH, depth * HEIGHT, width * WIDTH
        colour = f"hsl({20 + sum(map(ord, name)) % 35} 85% 65%)"
        title = html.escape(f"{name} {100 * width:.1f} %")
        label = html.escape(name[: int(w / 7)])
        drawn.append(
            f"<g><title>{title}</title>"
            f'<rect x="{x:.1f}" y="{y}" width="{w:.1f}" height="{HEIGHT - 1}" fill="{colour}"/>'
            f'<text x="{x + 3:.1f}" y="{y + 13}">{label}</text></g>'
        )
        drawn += frames(group, depth + 1, left, width)
        left += width
    return drawn


def main() -> None:
    """Samples, names them, draws."""
    for tool in ("perf", "addr2line"):
        if shutil.which(tool) is None:
            raise SystemExit(f"make profile needs '{tool}': install your system's packages for perf and binutils.")
    import hdfast._core

    OUT.mkdir(parents=True, exist_ok=True)
    stacks = named(recorded(hdfast._core.__file__), hdfast._core.__file__)
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT * DEPTH}" font-size="12">'
    picture = "\n".join([head, *frames(stacks), "</svg>"])
    (OUT / "flame.svg").write_text(picture, encoding="utf-8")
    shares: collections.Counter[str] = collections.Counter()
    for stack, count in stacks.items():
        for name in set(stack):
            shares[name] += count
    for name, count in shares.most_common(25):
        print(f"{100 * count / sum(stacks.values()):6.1f} %  {name}")
    print(OUT / "flame.svg")


if __name__ == "__main__":
    main()
