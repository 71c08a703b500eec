from __future__ import annotations

import errno
import os
import stat

import pytest

from bellcrank.errors import OutputExists, StorageError
from bellcrank.model.storage import read_text, write_text


def fail_with(code):
    def fail(*args, **kwargs):
        raise OSError(code, os.strerror(code))

    return fail


def test_text_survives_writing_and_reading(tmp_path):
    write_text(tmp_path / "a.txt", "grüße\n")
    assert read_text(tmp_path / "a.txt") == "grüße\n"


def test_files_get_the_permissions_that_any_new_file_gets(tmp_path):
    (tmp_path / "plain.txt").write_text("")
    write_text(tmp_path / "ours.txt", "")
    modes = [stat.S_IMODE((tmp_path / n).stat().st_mode) for n in ("plain.txt", "ours.txt")]
    assert modes[0] == modes[1]


@pytest.mark.parametrize("call", ["fsync", "replace"])
def test_a_full_disk_leaves_the_old_file_and_no_debris(tmp_path, monkeypatch, call):
    path = tmp_path / "a.txt"
    write_text(path, "old")
    target = "pathlib.Path.replace" if call == "replace" else "os.fsync"
    monkeypatch.setattr(target, fail_with(errno.ENOSPC))
    with pytest.raises(StorageError, match=r"a.txt: cannot be written \(No space left on device\)"):
        write_text(path, "new", overwrite=True)
    assert read_text(path) == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


def test_a_file_system_without_links_is_written_to_all_the_same(tmp_path, monkeypatch):
    monkeypatch.setattr("os.link", fail_with(errno.EPERM))
    write_text(tmp_path / "a.txt", "once")
    assert read_text(tmp_path / "a.txt") == "once"
    with pytest.raises(OutputExists):
        write_text(tmp_path / "a.txt", "twice")


def test_of_two_writers_the_first_wins(tmp_path, monkeypatch):
    path = tmp_path / "a.txt"
    take = os.link

    def somebody_was_faster(source, target):
        path.write_text("first")
        take(source, target)

    monkeypatch.setattr("os.link", somebody_was_faster)
    with pytest.raises(OutputExists, match="exists already"):
        write_text(path, "second")
    assert read_text(path) == "first"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


def test_a_folder_that_does_not_exist_is_an_error(tmp_path):
    with pytest.raises(StorageError, match="No such file or directory"):
        write_text(tmp_path / "missing" / "a.txt", "text")
