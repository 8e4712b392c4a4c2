"""All nodes of a namespace see when the time of its simulation goes back."""

from contextlib import closing

from solfer.middleware.shared_memory import Namespace, XbotMiddleware


def node(folder, name):
    return closing(XbotMiddleware(Namespace("test", folder), name))


def test_every_node_counts_time_going_back(tmp_path):
    with node(tmp_path, "simulator") as simulator, node(tmp_path, "plugin") as plugin:
        for simulated in (0.0, 0.001, 0.002, 0.002):
            simulator.publish_time(simulated)
        assert plugin.rewinds == simulator.rewinds == 0
        before = plugin.now()
        simulator.publish_time(0.001)
        assert plugin.rewinds == simulator.rewinds == 1
        assert plugin.now() >= before  # the clock of the pipes is another one
        simulator.publish_time(5.0)
        assert plugin.rewinds == 1


def test_a_new_simulator_sets_the_time_back(tmp_path):
    with node(tmp_path, "plugin") as plugin:
        for start in range(2):
            with node(tmp_path, "simulator") as simulator:
                simulator.publish_time(0.001)
                assert plugin.rewinds == start
                simulator.publish_time(7.0)
        assert plugin.rewinds == 1


def test_where_nothing_is_simulated_no_time_goes_back(tmp_path):
    with node(tmp_path, "robot") as robot, node(tmp_path, "plugin") as plugin:
        robot.poll()
        assert plugin.rewinds == 0
