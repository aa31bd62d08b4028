#!/usr/bin/env python3
"""Plan: figures agree within the tolerance of their kind and not beyond it; times and texts that explain are not
compared; what only one folder has is named; each script that is run exists."""
import pathlib
import types
import unittest

import all_figures


def found(old, new):
    return list(all_figures.differences({"x": old}, {"x": new}))


class Agree(unittest.TestCase):
    def test_each_kind_has_its_tolerance(self):
        for key, near, far in [("bytes", 1029, 1035), ("psnr", 1000.4, 1000.6), ("max_error", 2999, 3001)]:
            self.assertEqual(found({key: 1000}, {key: near}), [])
            self.assertEqual(len(found({key: 1000}, {key: far})), 1)

    def test_an_error_of_nothing_is_not_near_an_error(self):
        self.assertEqual(found({"max": 0.0}, {"max": 0.0}), [])
        self.assertEqual(len(found({"max": 0.0}, {"max": 1e-9})), 1)

    def test_times_are_not_compared(self):
        self.assertEqual(found({"seconds": 1.0, "encode_seconds_with": 2}, {"seconds": 9.0, "encode_seconds_with": 1}), [])

    def test_states_must_be_equal(self):
        self.assertEqual(len(found({"stored": True}, {"stored": False})), 1)

    def test_names_identify_the_rows_of_a_list(self):
        old = [{"name": "a", "bytes": 1}, {"name": "b", "bytes": 2}]
        new = [{"name": "b", "bytes": 2}, {"name": "c", "bytes": 3}]
        self.assertEqual(found(old, new), ["/x/a: only in the old folder", "/x/c: only in the new folder"])


class Commands(unittest.TestCase):
    def test_run_scripts_that_exist(self):
        arguments = types.SimpleNamespace(out=pathlib.Path("OUT"), bin="BUILD", data="DATA", machine="TEXT",
                                          rivals=pathlib.Path("RIVALS"))
        names = set()
        for name, part, words in all_figures.commands(arguments):
            self.assertTrue((all_figures.HERE / words[0]).exists(), words[0])
            self.assertIn(part, all_figures.PARTS)
            names.add(name)
        self.assertEqual(names, set(all_figures.DOCUMENTS))


if __name__ == "__main__":
    unittest.main()
