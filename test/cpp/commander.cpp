/// A node in C++ that moves one joint, as a program that knows nothing of solfer's Python code would:
///     commander command|request JOINT DISTANCE
/// `command` sends solfer/JointCommand to the position controller, `request` asks the plugin joint_states.
/// Exit code 0: the joint moved by DISTANCE [rad]; 1: it did not, and why; 2: wrong arguments.

#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <solfer/GetJointNames.h>
#include <solfer/JointCommand.h>
#include <solfer/ListControllers.h>
#include <solfer/MoveJoints.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <limits>
#include <stdexcept>
#include <string>

namespace {

const std::string CONTROLLER = "position_controller";
constexpr double START = 60.0;      // longest time until the robot and its services are there [s]
constexpr double CLAIM = 5.0;       // longest time until the joint is ours [s]
constexpr double ARRIVAL = 40.0;    // longest time until the joint is at its goal, after the motion should end [s]
constexpr double TOLERANCE = 0.02;  // [rad]
constexpr double RATE = 100.0;      // [Hz]
constexpr double DURATION = 1.5;    // of a commanded motion [s]
constexpr double SPEED = 0.5;       // of a requested motion [rad/s]

/// Lets callbacks run until `holds`; after `timeout` [s of the wall clock] throws `what` was missing.
void wait_for(const std::function<bool()>& holds, double timeout, const std::function<std::string()>& what) {
  const ros::SteadyTime end = ros::SteadyTime::now() + ros::WallDuration(timeout);
  while (!holds()) {
    if (!ros::ok() || ros::SteadyTime::now() > end) throw std::runtime_error(what());
    ros::WallDuration(1.0 / RATE).sleep();
    ros::spinOnce();
  }
}

/// The reply of a service; throws if it is not there or says no.
template <class Service>
typename Service::Response call(const std::string& name, const typename Service::Request& request = {}) {
  typename Service::Response response;
  if (!ros::service::waitForService(name, ros::Duration(START))) throw std::runtime_error("no service " + name);
  if (!ros::service::call(name, request, response)) throw std::runtime_error(name + " does not answer");
  if (!response.success) throw std::runtime_error(name + ": " + response.message);
  return response;
}

/// One joint of the position controller: measured, commanded, requested.
class Joint {
 public:
  explicit Joint(const std::string& name) : name_(name) {
    const auto joints = call<solfer::GetJointNames>("/" + CONTROLLER + "/get_joint_names").names;
    if (std::find(joints.begin(), joints.end(), name) == joints.end())
      throw std::runtime_error(CONTROLLER + " has no joint '" + name + "'");
    states_ = node_.subscribe("/joint_states", 1, &Joint::take, this, ros::TransportHints().tcpNoDelay());
    wait_for([this] { return !std::isnan(position_); }, START, [] { return "no news on /joint_states"; });
  }

  /// Measured position [rad].
  double position() const { return position_; }

  /// Sends a smooth motion by `distance` [rad] that begins where the joint is measured.
  void command(double distance) {
    const double start = position_;
    claim(start);
    const ros::Time begin = ros::Time::now();
    ros::Rate rate(RATE);
    for (double part = 0.0; part < 1.0 && ros::ok(); rate.sleep()) {
      part = std::min(1.0, (ros::Time::now() - begin).toSec() / DURATION);
      send(start + 0.5 * distance * (1.0 - std::cos(M_PI * part)));
    }
    arrive(start + distance);
  }

  /// Asks the plugin to move the joint by `distance` [rad].
  void request(double distance) {
    solfer::MoveJoints::Request request;
    request.joints = {name_};
    request.positions = {position_ + distance};
    request.speed = SPEED;
    ros::Duration(call<solfer::MoveJoints>("/joint_states/trajectory", request).duration).sleep();
    arrive(request.positions[0]);
  }

 private:
  void take(const sensor_msgs::JointState& message) {
    const auto found = std::find(message.name.begin(), message.name.end(), name_);
    if (found != message.name.end()) position_ = message.position.at(found - message.name.begin());
  }

  void send(double position) {
    solfer::JointCommand message;
    message.header.stamp = ros::Time::now();
    message.name = {name_};
    message.position = {position};
    commands_.publish(message);
  }

  /// Commands `position` until the lower level says that it is this node that commands.
  void claim(double position) {
    std::string owners;
    const auto ours = [&] {
      send(position);
      const auto reply = call<solfer::ListControllers>("/lower_level/list_controllers");
      const auto found = std::find(reply.names.begin(), reply.names.end(), CONTROLLER);
      if (found != reply.names.end()) owners = reply.claimed_by.at(found - reply.names.begin());
      return owners.find(ros::this_node::getName() + ": ") != std::string::npos;
    };
    wait_for(ours, CLAIM, [&] { return name_ + " is not ours; " + CONTROLLER + " is commanded by " + owners; });
  }

  void arrive(double goal) {
    wait_for([&] { return std::abs(position_ - goal) < TOLERANCE; }, ARRIVAL, [&] {
      return name_ + " is at " + std::to_string(position_) + " instead of " + std::to_string(goal) + " rad";
    });
  }

  const std::string name_;
  double position_ = std::numeric_limits<double>::quiet_NaN();
  ros::NodeHandle node_;
  ros::Subscriber states_;
  ros::Publisher commands_ = node_.advertise<solfer::JointCommand>("/" + CONTROLLER + "/command", 1);
};

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "commander");
  const std::string mode = argc == 4 ? argv[1] : "";
  const double distance = argc == 4 ? std::atof(argv[3]) : 0.0;
  if ((mode != "command" && mode != "request") || !(std::abs(distance) > 2.0 * TOLERANCE)) {
    std::cerr << "usage: commander command|request JOINT DISTANCE, with more than " << 2.0 * TOLERANCE << " rad\n";
    return 2;
  }
  try {
    if (!ros::master::check()) throw std::runtime_error("no ROS master at " + ros::master::getURI());
    Joint joint(argv[2]);
    mode == "command" ? joint.command(distance) : joint.request(distance);
    std::cout << argv[2] << " moved to " << joint.position() << " rad\n";
  } catch (const std::exception& error) {
    std::cerr << "error: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
