"""Tests of record.py: what counts as worse, and what the page shows. Programs are not run."""
import copy
import io
import json
import pathlib
import sys
import tempfile
import types
import unittest
from contextlib import redirect_stdout

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "bench"))
import record  # noqa: the path must be known first

CASE = {"cpu": {"bytes": 10000, "user_seconds": 10.0, "seconds": 6.0, "memory": 5e7, "decode_seconds": 1.0,
                "missed": False, "grids": {"density": {"psnr_box": 50.0, "psnr_active": 40.0, "psnr_t50": 35.0}}},
        "gpu": {"bytes": 10000, "seconds": 2.0, "grids": {"density": {"psnr_box": 50.0, "psnr_active": 40.0, "psnr_t50": 35.0}}},
        "drawn": {"fps": 1000.0, "nanovdb_fps": 500.0, "picture_psnr": 60.0, "device_bytes": 2e7,
                  "nanovdb_device_bytes": 1e7}}


def content(change=lambda case: None):
    case = copy.deepcopy(CASE)
    change(case)
    return {"machine": {"cpu": "a CPU", "gpu": None, "date": "2026-01-01"}, "cases": {"smoke1": {"default": case}}}


class Compared(unittest.TestCase):
    def outcome(self, change, before=lambda case: None):
        """The exit code of a comparison, and what it prints."""
        with tempfile.TemporaryDirectory() as folder:
            old, new = pathlib.Path(folder) / "old.json", pathlib.Path(folder) / "new.json"
            old.write_text(json.dumps(content(before)))
            new.write_text(json.dumps(content(change)))
            with redirect_stdout(io.StringIO()) as text:
                code = record.compare(types.SimpleNamespace(old=old, new=new))
            return code, text.getvalue()

    def worse(self, part, name, value):
        return self.outcome(lambda case: case[part].update({name: value}))[0]

    def test_equal_figures_are_not_worse(self):
        self.assertEqual(self.outcome(lambda case: None)[0], 0)

    def test_limits_of_bytes_seconds_and_pictures(self):
        for part, name, allowed, beyond in [("cpu", "bytes", 10049, 10051), ("gpu", "bytes", 10049, 10051),
                                            ("cpu", "user_seconds", 10.4, 10.6), ("gpu", "seconds", 2.09, 2.11),
                                            ("drawn", "fps", 951.0, 949.0)]:
            self.assertEqual(self.worse(part, name, allowed), 0, name)
            self.assertEqual(self.worse(part, name, beyond), 4, name)

    def test_limit_of_a_psnr(self):
        for value, code in [(49.96, 0), (49.94, 4), (60.0, 0)]:
            self.assertEqual(self.outcome(lambda case: case["cpu"]["grids"]["density"].update(psnr_box=value))[0], code)

    def test_a_grid_that_is_no_longer_exact_is_worse(self):
        def exact(case):
            case["cpu"]["grids"]["density"].update(psnr_box=None)
        self.assertEqual(self.outcome(lambda case: None, exact)[0], 4)
        self.assertEqual(self.outcome(exact, lambda case: None)[0], 0)

    def test_small_differences_of_times_are_those_of_starting_a_process(self):
        self.assertEqual(self.outcome(lambda case: case["cpu"].update(decode_seconds=0.19),
                                      lambda case: case["cpu"].update(decode_seconds=0.1))[0], 0)

    def test_a_failure_is_worse_if_there_was_none(self):
        def failed(case):
            case["cpu"] = {"failure": "exit code 1"}
        self.assertEqual(self.outcome(failed)[0], 4)
        self.assertEqual(self.outcome(failed, failed)[0], 0)

    def test_the_figure_is_named(self):
        self.assertIn("smoke1, default: bytes 11,000 (+10.0 %)", self.outcome(lambda c: c["cpu"].update(bytes=11000))[1])


class Page(unittest.TestCase):
    def test_rows_have_figures_and_changes(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            (folder / "new.json").write_text(json.dumps(content(lambda case: case["cpu"].update(bytes=20000))))
            (folder / "old.json").write_text(json.dumps(content()))
            (folder / "page.md").write_text("# What it is\n\n" + record.bench.MADE + "\nold figures\n")
            record.page(types.SimpleNamespace(record=folder / "new.json", before=folder / "old.json",
                                              page=folder / "page.md"))
            text = (folder / "page.md").read_text()
        self.assertIn("| smoke1 | default | 20,000 (+100.0 %) **worse** | 50.00 | 40.00 | 35.00 | 10.00 | 50 | 1.00 | 2.00 |", text)
        self.assertTrue(text.startswith("# What it is\n"))
        self.assertNotIn("old figures", text)
        self.assertIn("| smoke1 | default | 500 | 1000 | 60.00 |", text)


if __name__ == "__main__":
    unittest.main()
