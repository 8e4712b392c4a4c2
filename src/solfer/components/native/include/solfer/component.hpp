// Components of solfer in C++17: a class of your own, derived from solfer::Component, and one line that exports it.
//
//   class Damper : public solfer::Component {
//    public:
//     static void declare(solfer::Tags &tags) { tags.number("damping", 2.0, "damping [Nms/rad]").at_least(0.0).live(); }
//     explicit Damper(solfer::Setup &setup)
//         : damping_(setup.number("damping")), velocity_(setup.state("velocity")), torque_(setup.command("torque")) {}
//     void send() override {
//       for (std::size_t i = 0; i < torque_.size(); ++i) torque_[i] = -damping_ * velocity_[i];
//     }
//    private:
//     const double &damping_;
//     solfer::View velocity_, torque_;
//   };
//   SOLFER_LIBRARY(SOLFER_COMPONENT(Damper))
//
// Names are looked up when the component is made. `update` and `send` read and write the Robot's own memory: nothing is
// copied, and no Python runs in them. Units and frames are those of the components in Python.
#ifndef SOLFER_COMPONENT_HPP
#define SOLFER_COMPONENT_HPP

#include <cmath>
#include <cstdio>
#include <deque>
#include <exception>
#include <functional>
#include <initializer_list>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "component.h"

namespace solfer {

/// What is wrong with a configuration or a request; its text reaches the user.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Live numbers, row by row. A copy shows the same numbers.
class View {
 public:
  explicit View(const solfer_array *array) : array_(array) {}

  double *data() const { return array_->data; }
  std::size_t size() const { return array_->rows * array_->columns; }
  std::size_t rows() const { return array_->rows; }
  std::size_t columns() const { return array_->columns; }
  double &operator[](std::size_t index) const { return array_->data[index]; }
  double &operator()(std::size_t row, std::size_t column) const { return array_->data[row * array_->columns + column]; }
  double *begin() const { return data(); }
  double *end() const { return data() + size(); }

 private:
  const solfer_array *array_;
};

/// Indices of DoFs.
class Indices {
 public:
  Indices(const std::size_t *data, std::size_t size) : data_(data), size_(size) {}

  std::size_t size() const { return size_; }
  std::size_t operator[](std::size_t index) const { return data_[index]; }
  const std::size_t *begin() const { return data_; }
  const std::size_t *end() const { return data_ + size_; }

 private:
  const std::size_t *data_;
  std::size_t size_;
};

/// The numbers of an SRDF group or a map, in its order.
class MappedView {
 public:
  MappedView(View view, Indices indices) : view_(view), indices_(indices) {}

  std::size_t size() const { return indices_.size(); }
  double &operator[](std::size_t index) const { return view_[indices_[index]]; }
  const Indices &indices() const { return indices_; }

 private:
  View view_;
  Indices indices_;
};

/// A Robot Point, computed before each `update`.
class Point {
 public:
  explicit Point(const solfer_point *point) : index(point->index), value(&point->value), jacobian(&point->jacobian) {}

  int index;
  View value;
  View jacobian;
};

/// A jump of the estimate of the base.
class Move {
 public:
  explicit Move(const solfer_move &move) : move_(move), cos_(std::cos(move.yaw)), sin_(std::sin(move.yaw)) {}

  double yaw() const { return move_.yaw; }
  /// Moves a place of the world along, 3 numbers [m].
  void place(double *at) const {
    const double x = at[0] - move_.before[0], y = at[1] - move_.before[1];
    at[0] = move_.after[0] + cos_ * x - sin_ * y;
    at[1] = move_.after[1] + sin_ * x + cos_ * y;
    at[2] += move_.after[2] - move_.before[2];
  }

 private:
  const solfer_move &move_;
  double cos_, sin_;
};

/// The time of a cycle [s], as `Component` in Python has it.
using Time = solfer_time;

/// The keys of a component in the configuration; texts have to live as long as the library, as literals do.
class Tags {
 public:
  /// Bounds of the tag that was declared last, and whether it is live.
  Tags &at_least(double lower) { return last().lower = lower, *this; }
  Tags &at_most(double upper) { return last().upper = upper, *this; }
  Tags &live() { return last().is_live = 1, *this; }

  Tags &number(const char *name, const char *description) { return add(name, description, SOLFER_NUMBER, true, 0.0); }
  Tags &number(const char *name, double value, const char *description) {
    return add(name, description, SOLFER_NUMBER, false, value);
  }
  Tags &integer(const char *name, const char *description) { return add(name, description, SOLFER_INTEGER, true, 0.0); }
  Tags &integer(const char *name, long value, const char *description) {
    return add(name, description, SOLFER_INTEGER, false, static_cast<double>(value));
  }
  Tags &flag(const char *name, bool value, const char *description) {
    return add(name, description, SOLFER_SWITCH, false, value ? 1.0 : 0.0);
  }
  Tags &text(const char *name, const char *description) { return add(name, description, SOLFER_TEXT, true, 0.0); }
  Tags &text(const char *name, const char *value, const char *description) {
    add(name, description, SOLFER_TEXT, false, 0.0);
    return last().value.text = value, *this;
  }
  Tags &numbers(const char *name, const char *description) { return add(name, description, SOLFER_NUMBERS, true, 0.0); }

  const std::vector<solfer_tag> &all() const { return tags_; }

 private:
  Tags &add(const char *name, const char *description, solfer_kind kind, bool is_required, double number) {
    tags_.push_back({name, description, kind, is_required ? 1 : 0, 0, {number, "", nullptr, 0}, -HUGE_VAL, HUGE_VAL});
    return *this;
  }
  solfer_tag &last() {
    if (tags_.empty()) throw Error("a bound without a tag");
    return tags_.back();
  }

  std::vector<solfer_tag> tags_;
};

using Numbers = std::vector<double>;
using Fields = std::vector<const char *>;

namespace detail {

/// An error whose text the host has.
class HostError : public std::exception {};

inline void write(char *text, std::size_t size, const char *what) { std::snprintf(text, size, "%s", what); }

/// Runs a call; writes the text of what it throws, and returns 1 then.
template <class Call>
int guarded(char *text, std::size_t size, Call &&call) noexcept {
  try {
    call();
    return 0;
  } catch (const std::exception &error) {
    write(text, size, error.what());
  } catch (...) {
    write(text, size, "an exception that is none of std::exception");
  }
  return 1;
}

/// A handler of a topic or of a service, at an address that stays.
struct Handler {
  std::function<void(const double *, double *)> call;

  static int run(void *user, const double *numbers, double *reply, char *error, std::size_t size) {
    return guarded(error, size, [&] { static_cast<Handler *>(user)->call(numbers, reply); });
  }
};

using Handlers = std::deque<Handler>;

}  // namespace detail

/// What a component is made of: names become views, numbers and handlers. All of it is valid as long as the component.
class Setup {
 public:
  Setup(const solfer_host &host, const std::vector<solfer_tag> &tags, detail::Handlers &handlers)
      : host_(host), tags_(tags), handlers_(handlers) {}

  const char *name() const { return host_.name; }
  std::size_t size() const { return host_.size; }
  const char *dof_name(std::size_t index) const { return host_.dofs[index]; }
  const Time &time() const { return *host_.time; }

  /// Values of tags; the number of a live one changes between two cycles.
  const double &number(const char *name) const { return tag(name, SOLFER_NUMBER).number; }
  long integer(const char *name) const { return std::lround(tag(name, SOLFER_INTEGER).number); }
  bool flag(const char *name) const { return tag(name, SOLFER_SWITCH).number != 0.0; }
  const char *text(const char *name) const { return tag(name, SOLFER_TEXT).text; }
  Numbers numbers(const char *name) const {
    const solfer_value &value = tag(name, SOLFER_NUMBERS);
    return {value.numbers, value.numbers + value.size};
  }

  std::size_t dof(const char *name) const {
    const long index = host_.dof(host_.context, name);
    if (index < 0) throw detail::HostError();
    return static_cast<std::size_t>(index);
  }
  /// DoFs of an SRDF group, or of a map of the Robot.
  Indices group(const char *name) const {
    std::size_t count = 0;
    const std::size_t *indices = checked(host_.group(host_.context, name, &count));
    return {indices, count};
  }
  std::vector<std::string> links(const char *group) const {
    std::size_t count = 0;
    const char *const *names = checked(host_.links(host_.context, group, &count));
    return {names, names + count};
  }

  /// Measured at the links, measured at the motors, and desired: "position", "velocity", "acceleration", "torque".
  View state(const char *interface) const { return array("state", interface); }
  View motor(const char *interface) const { return array("motor", interface); }
  View command(const char *interface) const { return array("command", interface); }
  MappedView state(const char *interface, const char *map) const { return {state(interface), group(map)}; }
  MappedView motor(const char *interface, const char *map) const { return {motor(interface), group(map)}; }
  MappedView command(const char *interface, const char *map) const { return {command(interface), group(map)}; }
  View lower_limits(const char *interface) const { return array("lower_limits", interface); }
  View upper_limits(const char *interface) const { return array("upper_limits", interface); }
  /// Where the joints are at `init`; to be read there.
  View start_position() const { return array("start", "position"); }

  /// Bias force h (n x 1), inertia M and its inverse (n x n), computed before each `update`.
  View bias() const { return array("dynamics", "bias"); }
  View inertia() const { return array("dynamics", "inertia"); }
  View inertia_inverse() const { return array("dynamics", "inertia_inverse"); }

  /// Robot Points: of a link, with an offset in its frame; of the whole Robot; of other points; constant.
  Point point(const char *kind, const char *link, const Numbers &offset = {}) const {
    return made(kind, link, {}, offset);
  }
  Point linear_point(const char *link, const Numbers &offset = {}) const { return point("LinearPoint", link, offset); }
  Point center_of_mass() const { return made("CenterOfMass", "", {}, {}); }
  Point minus(const Point &first, const Point &second) const { return made("Minus", "", {first, second}, {}); }
  Point plus(const Point &first, const Point &second) const { return made("Plus", "", {first, second}, {}); }
  Point norm(const Point &point) const { return made("Norm", "", {point}, {}); }
  Point constant(const Numbers &value) const { return made("Constant", "", {}, value); }

  /// Robot Points that pipes of the same name carry.
  View input(const char *name, const char *quantity) const { return port(0, name, quantity); }
  View output(const char *name, const char *quantity) const { return port(1, name, quantity); }

  /// Records numbers after each cycle; they stay where they are.
  void log(const char *name, const double *numbers, std::size_t size, const char *unit = "") const {
    checked(host_.log(host_.context, name, numbers, size, unit));
  }
  void receive(const char *topic, const char *interface, const Fields &fields,
               std::function<void(const double *)> handler) {
    solfer_endpoint endpoint = endpoint_of(topic, interface, fields);
    endpoint.user = keep([handler = std::move(handler)](const double *numbers, double *) { handler(numbers); });
    endpoint.handler = &detail::Handler::run;
    checked(host_.receive(host_.context, &endpoint));
  }
  /// Publishes numbers, which stay where they are, after each cycle, or `rate` times a second.
  void publish(const char *topic, const char *interface, const Fields &fields, const double *numbers,
               double rate = 0.0) {
    solfer_endpoint endpoint = endpoint_of(topic, interface, fields);
    endpoint.numbers = numbers;
    endpoint.rate = rate;
    checked(host_.publish(host_.context, &endpoint));
  }
  /// Offers a service whose reply has `success` and `message`, which come by themselves; a throw is a refusal.
  void serve(const char *name, const char *interface, const Fields &request, const Fields &reply,
             std::function<void(const double *, double *)> handler) {
    solfer_endpoint endpoint = endpoint_of(name, interface, request);
    endpoint.reply_fields = reply.data();
    endpoint.reply_field_count = reply.size();
    endpoint.user = keep(std::move(handler));
    endpoint.handler = &detail::Handler::run;
    checked(host_.serve(host_.context, &endpoint));
  }

 private:
  template <class T>
  static T *checked(T *result) {
    if (result == nullptr) throw detail::HostError();
    return result;
  }
  static void checked(int result) {
    if (result != 0) throw detail::HostError();
  }
  static solfer_endpoint endpoint_of(const char *name, const char *interface, const Fields &fields) {
    solfer_endpoint endpoint = {};
    endpoint.name = name;
    endpoint.interface = interface;
    endpoint.fields = fields.data();
    endpoint.field_count = fields.size();
    return endpoint;
  }
  View array(const char *source, const char *name) const {
    return View(checked(host_.array(host_.context, source, name)));
  }
  View port(int is_output, const char *name, const char *quantity) const {
    return View(checked(host_.port(host_.context, is_output, name, quantity)));
  }
  Point made(const char *kind, const char *link, std::initializer_list<Point> operands, const Numbers &numbers) const {
    std::vector<int> indices;
    for (const Point &each : operands) indices.push_back(each.index);
    const solfer_point_request request = {kind, link, indices.data(), indices.size(), numbers.data(), numbers.size()};
    return Point(checked(host_.point(host_.context, &request)));
  }
  const solfer_value &tag(const char *name, solfer_kind kind) const {
    for (std::size_t i = 0; i < tags_.size(); ++i)
      if (std::string(tags_[i].name) == name && tags_[i].kind == kind) return host_.tags[i];
    throw Error(std::string("the component reads a tag '") + name + "' that it does not declare, or of another kind");
  }
  detail::Handler *keep(std::function<void(const double *, double *)> call) {
    handlers_.push_back({std::move(call)});
    return &handlers_.back();
  }

  const solfer_host &host_;
  const std::vector<solfer_tag> &tags_;
  detail::Handlers &handlers_;
};

/// Base class of all components. What one of its functions throws is a fault: the robot holds, and the text is logged.
class Component {
 public:
  static constexpr const char *description = "";
  static void declare(Tags &) {}

  virtual ~Component() = default;
  virtual void init() {}    ///< begins where the robot is; called again after feedback was lost
  virtual void update() {}  ///< computes one cycle; must not block
  virtual void send() {}    ///< writes the desired State; must not block
  virtual void reset() {}   ///< forgets past states and requests; `init` follows
  virtual void stop() {}    ///< brings the desired State to rest
  /// Moves references that are given in the world; found out for a class that overrides it.
  virtual void move_world(const Move &) {}
};

namespace detail {

// Hidden: classes of one name in two libraries would share what is static in a template.
template <class T>
__attribute__((visibility("hidden"))) const std::vector<solfer_tag> &tags_of() {
  static const std::vector<solfer_tag> tags = [] {
    Tags declared;
    T::declare(declared);
    return declared.all();
  }();
  return tags;
}

/// A component with its handlers and the text of its newest error.
template <class T>
struct Instance {
  Handlers handlers;
  std::unique_ptr<T> component;
  char error[512] = "";

  static void *create(const solfer_host *host, char *error, std::size_t size) {
    try {
      auto made = std::make_unique<Instance>();
      Setup setup(*host, tags_of<T>(), made->handlers);
      made->component = std::make_unique<T>(setup);
      return made.release();
    } catch (const HostError &) {
      write(error, size, "");
    } catch (const std::exception &caught) {
      write(error, size, caught.what());
    } catch (...) {
      write(error, size, "an exception that is none of std::exception");
    }
    return nullptr;
  }
  static void destroy(void *instance) { delete static_cast<Instance *>(instance); }

  template <void (Component::*function)()>
  static int run(void *instance) {
    auto *self = static_cast<Instance *>(instance);
    return guarded(self->error, sizeof self->error, [self] { (self->component.get()->*function)(); });
  }
  static int move(void *instance, const solfer_move *move) {
    auto *self = static_cast<Instance *>(instance);
    return guarded(self->error, sizeof self->error, [self, move] { self->component->move_world(Move(*move)); });
  }
  static constexpr bool moves = !std::is_same_v<decltype(&T::move_world), void (Component::*)(const Move &)>;
  static const char *text(void *instance) { return static_cast<Instance *>(instance)->error; }
};

template <class T>
__attribute__((visibility("hidden"))) const solfer_class *make_class(const char *name) {
  static const solfer_class made = {
      name,
      T::description,
      tags_of<T>().data(),
      tags_of<T>().size(),
      &Instance<T>::create,
      &Instance<T>::destroy,
      &Instance<T>::template run<&Component::init>,
      &Instance<T>::template run<&Component::update>,
      &Instance<T>::template run<&Component::send>,
      &Instance<T>::template run<&Component::reset>,
      &Instance<T>::template run<&Component::stop>,
      Instance<T>::moves ? &Instance<T>::move : nullptr,
      &Instance<T>::text,
  };
  return &made;
}

}  // namespace detail
}  // namespace solfer

/// Exports components: SOLFER_LIBRARY(SOLFER_COMPONENT(First), SOLFER_COMPONENT(Second)), once in a library.
#define SOLFER_COMPONENT(Class) solfer::detail::make_class<Class>(#Class)
#define SOLFER_LIBRARY(...)                                                                            \
  extern "C" SOLFER_EXPORT const solfer_library_record *solfer_library(void) {                         \
    try {                                                                                              \
      static const solfer_class *const classes[] = {__VA_ARGS__};                                      \
      static const solfer_library_record record = {SOLFER_INTERFACE, sizeof classes / sizeof *classes, \
                                                   classes};                                           \
      return &record;                                                                                  \
    } catch (...) {                                                                                    \
      return nullptr; /* a class cannot declare its tags */                                            \
    }                                                                                                  \
  }

#endif
