// Components for tests: laws that Python has, too, and some that fail in each of the ways in which a component can.
#include <chrono>
#include <cstdlib>
#include <thread>
#include <vector>

#include "solfer/component.hpp"

// Nothing, as fast as it goes.
class Empty : public solfer::Component {
 public:
  explicit Empty(solfer::Setup &) {}
};

// Holds a posture in joint space with springs and dampers, and carries its own weight.
class JointSpace : public solfer::Component {
 public:
  static constexpr const char *description = "Holds joints where they are at the start.";
  static void declare(solfer::Tags &tags) {
    tags.text("joints", "all", "SRDF group of the joints that are held");
    tags.number("stiffness", 100.0, "stiffness [Nm/rad]").at_least(0.0).at_most(1e4).live();
    tags.number("damping", 2.0, "damping [Nms/rad]").at_least(0.0).at_most(1e3).live();
  }

  explicit JointSpace(solfer::Setup &setup)
      : stiffness_(setup.number("stiffness")),
        damping_(setup.number("damping")),
        joints_(setup.group(setup.text("joints"))),
        start_(setup.start_position()),
        position_(setup.state("position")),
        velocity_(setup.state("velocity")),
        bias_(setup.bias()),
        desired_(setup.command("position")),
        torque_(setup.command("torque")),
        held_(setup.size()),
        computed_(setup.size()),
        offset_(setup.size()) {
    setup.log("computed", computed_.data(), computed_.size(), "Nm");
    setup.receive("offset", "std_msgs/Float64MultiArray", {"data[2]"}, [this](const double *numbers) {
      for (std::size_t i = 0; i < 2; ++i) offset_[joints_[i]] = numbers[i];
    });
    setup.publish("first", "geometry_msgs/PointStamped", {"point.x", "point.y", "point.z"}, computed_.data());
    setup.serve("zero", "std_srvs/SetBool", {"data"}, {}, [this](const double *request, double *) {
      if (request[0] == 0.0) throw solfer::Error("there is nothing to do without `data`");
      for (double &each : offset_) each = 0.0;
    });
  }

  void init() override {
    for (std::size_t i = 0; i < held_.size(); ++i) desired_[i] = held_[i] = start_[i];
  }
  void update() override {
    for (std::size_t each : joints_) {
      const double error = held_[each] + offset_[each] - position_[each];
      computed_[each] = stiffness_ * error - damping_ * velocity_[each] + bias_[each];
    }
  }
  void send() override {
    for (std::size_t each : joints_) torque_[each] = computed_[each];
  }

 private:
  const double &stiffness_, &damping_;
  solfer::Indices joints_;
  solfer::View start_, position_, velocity_, bias_, desired_, torque_;
  std::vector<double> held_, computed_, offset_;
};

// Holds joints where they are, and fails as the tag `how` says, where the tag `when` says.
class Failing : public solfer::Component {
 public:
  static void declare(solfer::Tags &tags) {
    tags.text("how", "throw, strange, segfault, hang, sleep, or what a name is looked up for");
    tags.text("when", "update", "constructor, init, update");
    tags.integer("after", 0, "updates before that").at_least(0);
  }

  explicit Failing(solfer::Setup &setup) : how_(setup.text("how")), when_(setup.text("when")), left_(setup.integer("after")), start_(setup.start_position()), desired_(setup.command("position")) {
    if (how_ == "dof") setup.dof("no_such_joint");
    if (how_ == "interface") setup.state("no_such_interface");
    if (how_ == "point") setup.linear_point("no_such_link");
    if (how_ == "tag") setup.number("no_such_tag");
    if (how_ == "path") setup.publish("out", "std_msgs/Float64", {"data["}, &number_);
    fail("constructor");
  }
  void init() override {
    for (std::size_t i = 0; i < start_.size(); ++i) desired_[i] = start_[i];
    fail("init");
  }
  void update() override {
    if (left_-- <= 0) fail("update");
  }

 private:
  void fail(const char *where) {
    if (when_ != where) return;
    if (how_ == "throw") throw solfer::Error("the valve is stuck");
    if (how_ == "strange") throw 7;
    if (how_ == "segfault") *static_cast<volatile int *>(nullptr) = 1;
    if (how_ == "hang")
      for (volatile bool ends = false; !ends;) continue;
    if (how_ == "sleep") std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }

  std::string how_, when_;
  long left_;
  solfer::View start_, desired_;
  double number_ = 0.0;
};

// Keeps a place of the world, in the desired positions of the first three DoFs.
class Remembering : public solfer::Component {
 public:
  explicit Remembering(solfer::Setup &setup) : desired_(setup.command("position")) {}
  void init() override {
    for (std::size_t i = 0; i < 3; ++i) desired_[i] = 1.0 + i;
  }
  void move_world(const solfer::Move &move) override { move.place(desired_.data()); }

 private:
  solfer::View desired_;
};

SOLFER_LIBRARY(SOLFER_COMPONENT(Empty), SOLFER_COMPONENT(JointSpace), SOLFER_COMPONENT(Failing),
               SOLFER_COMPONENT(Remembering))
