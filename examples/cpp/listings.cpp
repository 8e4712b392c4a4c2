// Listings 2, 3, 4 and 16 of the paper as components in C++.
//
// g++ -std=c++17 -O2 -shared -fPIC -I$(python3 -m solfer.components.native) examples/cpp/listings.cpp -o liblistings.so
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "solfer/component.hpp"

namespace {

using Matrix = std::vector<solfer::Numbers>;

// Solves the symmetric A x = b, A positive definite, by Cholesky's factors; x takes the place of b.
void solve(Matrix &a, solfer::Numbers &b) {
  const std::size_t size = b.size();
  for (std::size_t j = 0; j < size; ++j) {
    for (std::size_t k = 0; k < j; ++k) a[j][j] -= a[j][k] * a[j][k];
    a[j][j] = std::sqrt(a[j][j]);
    for (std::size_t i = j + 1; i < size; ++i) {
      for (std::size_t k = 0; k < j; ++k) a[i][j] -= a[i][k] * a[j][k];
      a[i][j] /= a[j][j];
    }
  }
  for (std::size_t i = 0; i < size; ++i) {
    for (std::size_t k = 0; k < i; ++k) b[i] -= a[i][k] * b[k];
    b[i] /= a[i][i];
  }
  for (std::size_t i = size; i-- > 0;) {
    for (std::size_t k = i + 1; k < size; ++k) b[i] -= a[k][i] * b[k];
    b[i] /= a[i][i];
  }
}

}  // namespace

// Inverse kinematics of tasks, each a Robot Point with its reference: dq = -J' (J J' + d I)^-1 e in each cycle.
class Tracking : public solfer::Component {
 public:
  static void declare(solfer::Tags &tags) {
    tags.number("gain", 5.0, "how fast errors decay [1/s]").at_least(0.0).at_most(100.0).live();
    tags.number("damping", 1e-4, "damping of the inverse").at_least(1e-9).at_most(1.0);
    tags.numbers("way", "from the start to the references of all tasks, one after the other [m]");
  }

  explicit Tracking(solfer::Setup &setup)
      : gain_(setup.number("gain")),
        damping_(setup.number("damping")),
        way_(setup.numbers("way")),
        time_(setup.time()),
        start_(setup.start_position()),
        desired_(setup.command("position")),
        positions_(setup.size()) {}

  void init() override {
    for (std::size_t i = 0; i < positions_.size(); ++i) positions_[i] = start_[i];
    std::size_t row = 0;
    for (const solfer::Point &task : tasks_)
      for (double each : task.value) references_[row] = each + way_[row], ++row;
  }

  void update() override {
    std::size_t row = 0;
    for (const solfer::Point &task : tasks_)
      for (std::size_t i = 0; i < task.value.size(); ++i, ++row) {
        weights_[row] = task.value[i] - references_[row];
        jacobian_[row] = &task.jacobian(i, 0);
      }
    for (std::size_t i = 0; i < row; ++i) {
      for (std::size_t j = 0; j < row; ++j) {
        square_[i][j] = i == j ? damping_ : 0.0;
        for (std::size_t k = 0; k < positions_.size(); ++k) square_[i][j] += jacobian_[i][k] * jacobian_[j][k];
      }
    }
    solve(square_, weights_);
    const double share = gain_ * time_.step;
    for (std::size_t k = 0; k < positions_.size(); ++k)
      for (std::size_t i = 0; i < row; ++i) positions_[k] -= share * jacobian_[i][k] * weights_[i];
  }

  void send() override {
    for (std::size_t i = 0; i < positions_.size(); ++i) desired_[i] = positions_[i];
  }

 protected:
  // Each task has three numbers; the cycle allocates nothing.
  void track(const std::vector<solfer::Point> &tasks) {
    const std::size_t rows = 3 * tasks.size();
    if (way_.size() != rows)
      throw solfer::Error("`way` has " + std::to_string(way_.size()) + " numbers, the tasks have " +
                          std::to_string(rows));
    tasks_ = tasks;
    references_.resize(rows);
    weights_.resize(rows);
    jacobian_.resize(rows);
    square_.assign(rows, solfer::Numbers(rows));
  }

 private:
  const double &gain_;
  double damping_;
  solfer::Numbers way_;
  const solfer::Time &time_;
  solfer::View start_, desired_;
  solfer::Numbers positions_, references_, weights_;
  std::vector<solfer::Point> tasks_;
  std::vector<const double *> jacobian_;
  Matrix square_;
};

// Listing 2: a hand.
class PointTracking : public Tracking {
 public:
  static void declare(solfer::Tags &tags) {
    Tracking::declare(tags);
    tags.text("link", "link of the hand");
  }
  explicit PointTracking(solfer::Setup &setup) : Tracking(setup) {
    track({setup.linear_point(setup.text("link"))});
  }
};

// Listing 3: the centre of mass, and hands relative to the torso, all at once.
class TaskTracking : public Tracking {
 public:
  static void declare(solfer::Tags &tags) {
    Tracking::declare(tags);
    tags.text("hands", "SRDF group of the hands' links");
    tags.text("torso", "link that the hands are seen from");
  }
  explicit TaskTracking(solfer::Setup &setup) : Tracking(setup) {
    std::vector<solfer::Point> tasks = {setup.center_of_mass()};
    const solfer::Point torso = setup.linear_point(setup.text("torso"));
    for (const std::string &hand : setup.links(setup.text("hands")))
      tasks.push_back(setup.minus(setup.linear_point(hand.c_str()), torso));
    track(tasks);
  }
};

// Listing 4: how far points off two hands are from the base; it moves nothing.
class Distances : public solfer::Component {
 public:
  static void declare(solfer::Tags &tags) {
    tags.text("left", "link of the left hand");
    tags.text("right", "link of the right hand");
    tags.text("base", "link of the base");
  }
  explicit Distances(solfer::Setup &setup)
      : left_(distance(setup, "left")), right_(distance(setup, "right")), distances_(3) {
    setup.log("distances", distances_.data(), 2, "m");
    setup.publish("distances", "geometry_msgs/PointStamped", {"point.x", "point.y", "point.z"}, distances_.data());
  }
  void update() override {
    distances_[0] = left_.value[0];
    distances_[1] = right_.value[0];
  }

 private:
  static solfer::Point distance(solfer::Setup &setup, const char *hand) {
    const solfer::Point off = setup.linear_point(setup.text(hand), {0.0, 0.0, -0.15});
    return setup.norm(setup.minus(off, setup.linear_point(setup.text("base"))));
  }

  solfer::Point left_, right_;
  solfer::Numbers distances_;
};

// Listing 16: the joint-space component with a topic of its own, on which any navigation drives the robot.
class JointSpaceDriving : public solfer::Component {
 public:
  static void declare(solfer::Tags &tags) {
    tags.text("wheels", "wheels", "SRDF group of the wheels' joints");
    tags.number("radius", 0.078, "radius of a wheel [m]").at_least(0.001).at_most(10.0);
    tags.numbers("turns", "1 for each wheel that goes ahead when it turns about its axis, else -1");
  }
  explicit JointSpaceDriving(solfer::Setup &setup)
      : wheels_(setup.group(setup.text("wheels"))),
        radius_(setup.number("radius")),
        turns_(setup.numbers("turns")),
        start_(setup.start_position()),
        position_(setup.command("position")),
        velocity_(setup.command("velocity")) {
    if (turns_.size() != wheels_.size()) throw solfer::Error("`turns` needs a number for each wheel");
    setup.receive("cmd_vel", "geometry_msgs/Twist", {"linear.x"}, [this](const double *twist) { ahead_ = twist[0]; });
  }
  void init() override {
    ahead_ = 0.0;
    for (std::size_t i = 0; i < position_.size(); ++i) position_[i] = start_[i];
  }
  void send() override {
    for (std::size_t i = 0; i < wheels_.size(); ++i) velocity_[wheels_[i]] = turns_[i] * ahead_ / radius_;
  }
  void stop() override {
    ahead_ = 0.0;
    send();
  }

 private:
  solfer::Indices wheels_;
  double radius_;
  solfer::Numbers turns_;
  solfer::View start_, position_, velocity_;
  double ahead_ = 0.0;
};

SOLFER_LIBRARY(SOLFER_COMPONENT(PointTracking), SOLFER_COMPONENT(TaskTracking), SOLFER_COMPONENT(Distances),
               SOLFER_COMPONENT(JointSpaceDriving))
