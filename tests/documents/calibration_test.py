"""Tests of calibration.py: FLIP, the measures and the statistics at values that are known. Nothing is rendered."""
import math
import pathlib
import sys
import unittest

try:
    import numpy as np
except ModuleNotFoundError:
    print("python3-numpy is missing")
    sys.exit(77)

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "bench"))
import calibration  # noqa: the path must be known first


def picture(red, green, blue, side=40):
    return np.broadcast_to(np.array([red, green, blue], float), (side, side, 3))


def flip(a, b):
    return calibration.flip_of_paper.flip(a, b, calibration.PIXELS_PER_DEGREE)


class Flip(unittest.TestCase):
    def setUp(self):
        rng = np.random.default_rng(1)
        self.a, self.b = rng.random((2, 40, 40, 3))

    def test_equal_pictures_have_no_difference(self):
        self.assertEqual(flip(self.a, self.a).max(), 0)

    def test_it_does_not_depend_on_the_order_of_the_pictures(self):
        np.testing.assert_allclose(flip(self.a, self.b), flip(self.b, self.a), rtol=1e-12)

    def test_green_and_blue_are_the_farthest_colors(self):
        np.testing.assert_allclose(flip(picture(0, 1, 0), picture(0, 0, 1)), 1, rtol=1e-9)

    def test_of_black_and_white_follows_from_the_lightness_alone(self):
        # HyAB is 100, above the knee at 0.4 of the largest difference d; pictures of one color have no features.
        hunt_lab = calibration.flip_of_paper.hunt_lab
        d = calibration.flip_of_paper.hyab(hunt_lab(np.array([0., 1, 0])), hunt_lab(np.array([0., 0, 1]))) ** 0.7
        expected = 0.95 + 0.05 * (100 ** 0.7 - 0.4 * d) / (0.6 * d)
        np.testing.assert_allclose(flip(picture(0, 0, 0), picture(1, 1, 1)), expected, rtol=1e-9)

    def test_a_smaller_difference_has_a_lower_value(self):
        near, far = (self.a + share * (self.b - self.a) for share in (0.1, 0.5))
        self.assertLess(flip(self.a, near).mean(), flip(self.a, far).mean())


class Measures(unittest.TestCase):
    def test_transmittance_of_a_cube_that_gets_denser(self):
        source, denser = np.full((4, 4, 4), 0.5), np.full((4, 4, 4), 0.6)
        figures = calibration.of_light(source, denser, 0.3)
        error = math.exp(-0.3 * 2) - math.exp(-0.3 * 2.4)
        self.assertAlmostEqual(figures["t_same"], -20 * math.log10(error), 9)
        self.assertAlmostEqual(figures["t_filled"], figures["t_same"], 9)
        self.assertAlmostEqual(figures["t_body"], figures["t_same"], 9)
        self.assertAlmostEqual(figures["t_exposed"], 20 * math.log10((1 - math.exp(-0.6)) / error), 9)

    def test_space_around_a_smoke_raises_the_figure_of_all_columns_alone(self):
        source = np.zeros((2, 2, 2))
        source[0, 0, 0] = 1  # three of twelve columns
        figures = calibration.of_light(source, 2 * source, 1.0)
        for measure in ("t_filled", "t_body"):
            self.assertAlmostEqual(figures["t_same"] - figures[measure], 10 * math.log10(4), 9)

    def test_haze_where_the_source_is_empty_counts_unless_only_filled_columns_do(self):
        source, hazy = np.zeros((2, 2, 2)), np.full((2, 2, 2), 0.01)
        source[0, 0, 0] = hazy[0, 0, 0] = 1
        figures = calibration.of_light(source, hazy, 1.0)
        self.assertGreater(figures["t_filled"], figures["t_body"])
        self.assertLess(figures["t_display"], figures["t_exposed"])  # a display shows faint light more brightly

    def test_a_voxel_scatters_what_does_not_pass(self):
        k, v = 0.7, np.zeros((3, 3, 3), np.float32)
        v[1, 1, 1] = 2
        opacity = 1 - math.exp(-k * 2)
        # The light has passed half of the voxel before, and passes the other half after it was scattered.
        np.testing.assert_allclose(sorted(calibration.lit(v, k))[-3:], 3 * [opacity * math.exp(-k * 2)], rtol=1e-6)
        self.assertEqual(np.count_nonzero(calibration.lit(v, k)), 3)

    def test_noise_of_two_seeds_is_no_difference(self):
        rng = np.random.default_rng(2)
        picture = rng.random((64, 64, 3))
        noisy = [[picture + rng.normal(0, 0.1, picture.shape) for _ in range(2)] for _ in range(2)]
        one_seed = calibration.of_pictures([noisy[0][0]], [noisy[1][0]], 1.0)
        self.assertAlmostEqual(one_seed["psnr"], -10 * math.log10(2 * 0.1 ** 2), 0)
        shifted = [seed + 0.05 for seed in noisy[1]]
        both = calibration.of_pictures(noisy[0], shifted, 1.0)
        self.assertAlmostEqual(both["psnr"], -20 * math.log10(0.05), 0)
        self.assertLess(abs(calibration.of_pictures(*noisy, 1.0)["standard_errors"]), 4)
        self.assertGreater(both["standard_errors"], calibration.CERTAIN)


class Statistics(unittest.TestCase):
    def test_equal_values_share_their_rank(self):
        self.assertEqual(list(calibration.ranks([10.0, 30.0, 10.0, 20.0])), [1.5, 4.0, 1.5, 3.0])

    def test_correlation_of_lines_and_curves(self):
        x = np.arange(9.0)
        self.assertAlmostEqual(calibration.correlation(x, 3 - 2 * x), -1, 12)
        self.assertAlmostEqual(calibration.rank_correlation(x, np.exp(x)), 1, 12)
        self.assertLess(calibration.correlation(x, np.exp(x)), 0.9)
        self.assertIsNone(calibration.correlation(x, np.ones(9)))

    def test_residual_is_the_scatter_around_the_line(self):
        x = np.array([0.0, 0, 1, 1])
        self.assertAlmostEqual(calibration.residual(x, np.array([-1.0, 1, 9, 11])), 1, 12)

    def test_pairs_count_within_a_smoke_and_a_density(self):
        def row(measure, figure, smoke="a", light="0.5"):
            return {"smoke": smoke, "light": light, "m": measure, "f": figure}
        rows = [row(1, 10), row(2, 20), row(3, 15)]
        self.assertEqual(calibration.in_order(rows, "m", "f"), (2, 3))
        self.assertEqual(calibration.in_order(rows + [row(0, 99, "b"), row(0, 99, light="0.1")], "m", "f"), (2, 3))
        self.assertEqual(calibration.in_order([row(1, 10), row(2, 10.5)], "m", "f"), (0, 0))  # too similar


if __name__ == "__main__":
    unittest.main()
