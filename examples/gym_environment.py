"""Train a controller in a Gymnasium environment: pull the platform of planar-3 to a target.

You see how near a simple policy brings it. A seed in `reset` restarts the simulation.
"""

import gymnasium as gym
import numpy as np

import cdpr_rt as cdpr

Info = dict[str, object]
STEP_S, MOST_N, TARGET_M = 0.02, 15.0, np.array([0.0, 1.6])


class Agent(cdpr.Controller):  # exerts a force, or without one moves to a start
    force: np.ndarray | None = None
    offset = np.zeros(2)

    def update(self, state: cdpr.State, target: cdpr.Target) -> np.ndarray:
        self.seen = np.array([*(state.position - TARGET_M), *state.velocity], np.float32)
        back = 800.0 * (target.position + self.offset - state.position) - 150.0 * state.velocity
        return state.distribute(back if self.force is None else self.force)


class Reach(gym.Env[np.ndarray, np.ndarray]):  # actions: force / MOST_N
    action_space, observation_space = gym.spaces.Box(-1, 1, (2,)), gym.spaces.Box(-10, 10, (4,))
    robot: cdpr.Robot

    def reset(self, *, seed: int | None = None, options: object = None) -> tuple[np.ndarray, Info]:
        super().reset(seed=seed)
        if seed is not None or not hasattr(self, "robot") or self.robot.state != "active":
            self.close()
            self.agent = Agent()
            self.robot = cdpr.simulate("planar-3", controller=self.agent)
            self.robot.enable()
            self.robot.tighten()
            self.robot.move_to(TARGET_M)
        self.agent.force, self.agent.offset = None, self.np_random.uniform(-0.1, 0.1, 2)
        self.robot.wait(1.0)
        return self.agent.seen, {}  # offset from the target, velocity

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, Info]:
        self.agent.force, fault = MOST_N * action, False
        try:
            self.robot.wait(STEP_S)
        except cdpr.Faulted:  # too far from the target, for example
            fault = True
        return self.agent.seen, -float(np.hypot(*self.agent.seen[:2])), fault, False, {}

    def close(self) -> None:
        if hasattr(self, "robot"):
            self.robot.close()


if __name__ == "__main__":
    with gym.wrappers.TimeLimit(Reach(), max_episode_steps=100) as env:
        seen = env.reset(seed=1)[0]
        for _ in range(100):
            seen = env.step(np.clip(-40.0 * seen[:2] - 8.0 * seen[2:], -1.0, 1.0))[0]
    print(f"{1e3 * np.hypot(*seen[:2]):.0f} mm from the target after 2 s")
