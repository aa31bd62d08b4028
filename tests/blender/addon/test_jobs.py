"""Jobs keep results and errors; programs are ended when a job is cancelled; what is missing is named."""
import os
import sys
import time

import pytest
from esvr_blender.jobs import Cancelled, Job, JobFailed, find_program

PROMPT = 10.0  # seconds, far below the sleep of the program


def finished(work):
    job = Job(work)
    job.start()
    job.wait()
    assert job.is_done
    return job


def test_a_job_keeps_its_result():
    assert finished(lambda job: 5).result == 5


def test_a_job_keeps_its_error():
    def work(job):
        raise JobFailed("no")
    assert str(finished(work).error) == "no"


def python(code):
    return lambda job: job.run_program([sys.executable, "-c", code], os.getcwd())


def test_the_text_of_a_program_comes_back():
    assert finished(python("import sys; sys.stdout.buffer.write('böse'.encode())")).result == "böse"
    assert finished(python("import sys; sys.stdout.buffer.write(bytes([255]))")).result == "\ufffd"


def test_the_text_is_seen_while_the_program_runs_and_is_whole_afterwards():
    code = "import time\nfor i in range(20): print('line', i, flush=True); time.sleep(0.02)"
    seen = []
    job = finished(lambda job: job.run_program([sys.executable, "-c", code], os.getcwd(), seen.append))
    assert job.result.splitlines() == [f"line {i}" for i in range(20)]
    assert any(0 < len(text.splitlines()) < 20 for text in seen)


def test_a_program_that_fails_tells_why():
    job = finished(python("import sys; print('{}'); sys.exit('the reason')"))
    assert isinstance(job.error, JobFailed) and str(job.error) == "the reason"


def test_a_program_that_fails_without_a_word_has_its_exit_code_told():
    assert "exit code 3" in str(finished(python("raise SystemExit(3)")).error)


@pytest.mark.parametrize("code", [
    "import time; time.sleep(60)",
    "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); time.sleep(60)"])
def test_cancelling_ends_the_program(code):
    job = Job(python(code))
    start = time.monotonic()
    job.start()
    time.sleep(0.5)
    assert not job.is_done
    job.cancel()
    job.wait()
    assert isinstance(job.error, Cancelled) and time.monotonic() - start < PROMPT


def test_a_program_that_cannot_be_started_is_named():
    job = finished(lambda job: job.run_program(["/no/such/program"], os.getcwd()))
    assert "/no/such/program" in str(job.error)


def test_programs_are_found_in_the_path_and_at_their_path(tmp_path, monkeypatch):
    program = tmp_path / "esvr tool"
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    assert find_program("esvr2vdb", str(program)) == str(program)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert find_program("esvr tool") == str(program)


@pytest.mark.parametrize("path", ["", "/no/such/esvr2vdb"])
def test_a_missing_program_is_named(tmp_path, monkeypatch, path):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(JobFailed, match="esvr2vdb.*preferences"):
        find_program("esvr2vdb", path)
