#!/usr/bin/env python3
"""complete_in_zsh.py COMPLETION PATH...: types words into zsh and presses Tab, with the programs in the
folders. Exits with 77 where zsh is missing."""
import os
import pathlib
import pty
import shutil
import sys
import tempfile
import threading
import time

LIMIT_S = 60
# Ctrl-X writes the line that is being edited to a file, and Ctrl-U empties it.
START = """
PS1=; fpath=($ZDOTDIR $fpath); autoload -U compinit; compinit -u -D
keep() { print -r -- "$BUFFER" > $ZDOTDIR/part; mv $ZDOTDIR/part $ZDOTDIR/line }
zle -N keep; bindkey '^X' keep; bindkey '^U' kill-whole-line; bindkey '^I' expand-or-complete
"""
EXPECTED = {
    "vdb2esvr --psn": "vdb2esvr --psnr ",
    "esvr-compare ta": "esvr-compare table ",
    "esvr-compare check --max-b": "esvr-compare check --max-bytes ",
}


def start_shell(home, path):
    environment = {"HOME": home, "ZDOTDIR": home, "PATH": path, "TERM": "dumb"}
    process, terminal = pty.fork()
    if process == 0:
        os.execvpe("zsh", ["zsh", "-i"], environment)
    threading.Thread(target=read_all, args=(terminal,), daemon=True).start()
    return terminal


def read_all(terminal):
    """Takes what the shell shows, so that it never waits for the terminal."""
    try:
        while os.read(terminal, 4096):
            pass
    except OSError:
        pass


def typed(terminal, line, keys):
    os.write(terminal, keys.encode())
    end = time.monotonic() + LIMIT_S
    while not line.exists():
        if time.monotonic() > end:
            return "nothing"
        time.sleep(0.02)
    text = line.read_text().rstrip("\n")
    line.unlink()
    return text


def main():
    if not shutil.which("zsh"):
        print("skipped: zsh is missing")
        return 77
    completion, *folders = sys.argv[1:]
    wrong = 0
    with tempfile.TemporaryDirectory() as home:
        shutil.copy(pathlib.Path(completion) / "_esvr", home)
        pathlib.Path(home, ".zshrc").write_text(START)
        terminal = start_shell(home, os.pathsep.join(folders + [os.environ["PATH"]]))
        for words, expected in EXPECTED.items():
            found = typed(terminal, pathlib.Path(home, "line"), f"\x15{words}\t\x18")
            if found != expected:
                print(f"'{words}' became '{found}', not '{expected}'")
                wrong += 1
        os.write(terminal, b"\x15exit\n")
        os.close(terminal)
    return wrong > 0


sys.exit(main())
