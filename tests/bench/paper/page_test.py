#!/usr/bin/env python3
"""Plan: docs/paper.md is what page.py makes of its figures; each cell is that of the right row, the best is bold, a form
without a file has no figure, and a report of an interrupted program is measured again."""
import json
import pathlib
import re
import tempfile
import unittest

import measure
import page


def row(name, group, bytes_, psnr_box):
    return {"name": name, "group": group, "bytes": bytes_, "psnr_box": psnr_box}


def figures():
    """A volume with a file of 100 bytes at 40 dB."""
    looks = {"viridis:linear": [row("pruned.esvr", "ESVR", 500, 35.0)]}
    volume = {"bytes": 100, "rows": [row("ours.esvr", "ESVR", 100, 40.0), row("ZFP accuracy", "at 100 bytes", 90, 30.0),
                                     row("ZFP precision", "at 100 bytes", 95, 31.0),
                                     {"name": "OpenVDB half Blosc", "group": "at 100 bytes", "note": "out of reach"},
                                     row("ZFP accuracy", "at 40.00 dB", 250, 41.0)], "looks": looks}
    compressors = {"rows": [row("SPERR", "at 100 bytes", 99, 42.0), row("SPERR", "at 40.00 dB", 90, 40.1)]}
    ngp = {"looks": {"viridis:linear": [row("Instant-NGP x 1", "external", 98, 20.0),
                                        row("Instant-NGP x 4", "external", 390, 39.0)]}}
    return page.Figures("breast", {"volumes": {"breast": volume}, "compressors": {"breast": compressors},
                                   "ngp": {"breast": ngp}})


def cells(table):
    return [cell.strip() for cell in table.splitlines()[-1].strip("|").split("|")]


class Page(unittest.TestCase):
    def test_is_what_its_figures_make(self):
        parts, machines = page.load(page.ROOT / "docs")
        for name, content in page.contents(parts, machines).items():
            self.assertEqual((page.ROOT / "docs" / name).read_text(), content, f"run page.py to remake {name}")

    def test_has_no_place_without_a_figure(self):
        parts, machines = page.load(page.ROOT / "docs")
        self.assertEqual(re.findall(r"\{[A-Z_]+\}", page.contents(parts, machines)["paper.md"]), [])


class Tables(unittest.TestCase):
    def test_at_equal_size_have_the_best_row_of_a_form(self):
        self.assertEqual(cells(page.size_matched([figures()])),
                         ["Breast", "100", "40.00", "35.00", "20.00", "**42.00**", "-", "-", "31.00", "-", "-"])

    def test_at_equal_psnr_have_multiples_of_our_bytes(self):
        self.assertEqual(cells(page.psnr_matched([figures()])),
                         ["Breast", "40.00", "100", "> 3.9", "0.9", "-", "-", "2.5", "-"])

    def test_say_who_is_ahead(self):
        self.assertIn("2.00 dB below SPERR", page.margins([figures()]))
        self.assertIn("on 0 of these 1 volumes", page.finding([figures()]))


class Kept(unittest.TestCase):
    def test_reports_of_interrupted_programs_are_made_again(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "report.json"
            path.write_text(json.dumps({"interrupted": True}))
            made = measure.kept(path, lambda p: p.write_text(json.dumps({"rows": 1})))
            self.assertEqual(made, {"rows": 1})
            self.assertEqual(measure.kept(path, lambda p: self.fail("it was there")), {"rows": 1})


if __name__ == "__main__":
    unittest.main()
