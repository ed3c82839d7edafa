"""Hours of the grid from costs that can be added up by hand."""

import unittest

from bench.grid_hours import DOMAINS, cell_parts, estimate, grid_hours
from plots.records import FIDELITIES, METHODS, TASKS


def parts(physics: float, products: float, rest: float) -> dict[str, float]:
    return {"physics": physics, "products": products, "rest": rest}


class GridHours(unittest.TestCase):
    def test_the_rest_is_what_physics_and_products_leave(self) -> None:
        cell = {"physics_us": 30.0, "bound_products_us": 7.0, "total_us": 42.5}
        self.assertEqual(cell_parts(cell), parts(30, 7, 5.5))

    def test_an_untimed_cell_lies_on_the_line_over_ppo(self) -> None:
        cells = {
            ("HalfCheetah-v2", "ppo", "paper"): parts(30, 2, 10),
            ("Humanoid-v2", "ppo", "paper"): parts(300, 6, 20),
            ("HalfCheetah-v2", "oc", "paper"): parts(31, 5, 100),
            ("Humanoid-v2", "oc", "paper"): parts(290, 25, 50),
            ("Ant-v2", "ppo", "paper"): parts(200, 3, 12),
        }
        # Products 5 + 20/4 (3 - 2), the rest 100 - 50/10 (12 - 10); physics is the task's.
        self.assertEqual(estimate(cells, "Ant-v2", "oc", "paper"), parts(200, 10, 90))
        self.assertEqual(estimate(cells, "Humanoid-v2", "oc", "paper"), parts(290, 25, 50))

    def test_each_task_has_its_steps_of_all_its_runs(self) -> None:
        cells = {(task, method, fidelity): parts(36, 18, 9) for task in (*TASKS, *DOMAINS.values())
                 for method in METHODS for fidelity in FIDELITIES}
        hours = dict(grid_hours(cells))
        self.assertEqual(len(hours), 16)
        # 8 methods, 2 fidelities, 10 seeds of 1e6 steps at 36, 18 and 9 us; pairs of 2e6.
        for task, factor in (("Ant-v2", 1), ("Walker2", 2)):
            for part, value in parts(1.6, 0.8, 0.4).items():
                self.assertAlmostEqual(hours[task][part], factor * value)


if __name__ == "__main__":
    unittest.main()
