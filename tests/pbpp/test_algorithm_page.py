"""The code on the algorithm page runs as it stands."""

import re
from pathlib import Path

PAGE = Path(__file__).parents[2] / "docs" / "algorithm.md"


def test_the_code_blocks_run_one_after_the_other():
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(), flags=re.DOTALL)
    assert len(blocks) >= 5
    names = {}
    for block in blocks:
        exec(compile(block, str(PAGE), "exec"), names)


def test_every_picture_is_there():
    pictures = re.findall(r"\((figures/[\w-]+\.svg)\)", PAGE.read_text())
    assert len(pictures) >= 5
    assert all((PAGE.parent / picture).stat().st_size > 1000 for picture in pictures)
