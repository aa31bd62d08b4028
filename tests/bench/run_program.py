"""Runs a program for the scripts that measure."""
import subprocess


def run(words):
    """Returns what the program prints. A failure ends the script with the program's message."""
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f'{" ".join(map(str, words))}\n{done.stderr}')
    return done.stdout
