// Runs each component of components.cpp that does not fail in a process without Python: this is the host. Built
// with the sanitizer of addresses, which counts allocations; it ends with 1 where a cycle allocates or a number is wrong.
#include <cmath>
#include <cstdio>
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "solfer/component.h"

// of the sanitizer's runtime, whose header Debian's compiler lacks
extern "C" int __sanitizer_install_malloc_and_free_hooks(void (*)(const volatile void *, std::size_t),
                                                         void (*)(const volatile void *));

namespace {

long allocations = 0;

void count(const volatile void *, std::size_t) { ++allocations; }
void ignore(const volatile void *) {}

constexpr std::size_t SIZE = 5;

struct World {
  std::map<std::string, std::vector<double>> numbers;
  std::map<std::string, solfer_array> arrays;
  std::vector<std::size_t> all;
  solfer_handler handlers[2] = {nullptr, nullptr};
  void *users[2] = {nullptr, nullptr};
  std::size_t logged = 0, published = 0;
};

World &world(void *context) { return *static_cast<World *>(context); }

long dof(void *, const char *) { return 0; }
const std::size_t *group(void *context, const char *, std::size_t *count) {
  *count = world(context).all.size();
  return world(context).all.data();
}
const char *const *links(void *, const char *, std::size_t *count) {
  *count = 0;
  return nullptr;
}
const solfer_array *array(void *context, const char *source, const char *name) {
  const std::string key = std::string(source) + "/" + name;
  std::vector<double> &numbers = world(context).numbers[key];
  numbers.resize(SIZE);
  world(context).arrays[key] = {numbers.data(), SIZE, 1};
  return &world(context).arrays[key];
}
const solfer_point *point(void *, const solfer_point_request *) { return nullptr; }
const solfer_array *port(void *, int, const char *, const char *) { return nullptr; }
int log_numbers(void *context, const char *, const double *, std::size_t size, const char *) {
  world(context).logged = size;
  return 0;
}
int receive(void *context, const solfer_endpoint *topic) {
  world(context).handlers[0] = topic->handler;
  world(context).users[0] = topic->user;
  return 0;
}
int publish(void *context, const solfer_endpoint *topic) {
  world(context).published = topic->field_count;
  return 0;
}
int serve(void *context, const solfer_endpoint *service) {
  world(context).handlers[1] = service->handler;
  world(context).users[1] = service->user;
  return 0;
}

int check(bool holds, const char *what) {
  if (!holds) std::printf("wrong: %s\n", what);
  return holds ? 0 : 1;
}

int run(const solfer_class &made) {
  std::vector<solfer_value> tags;
  for (std::size_t i = 0; i < made.tag_count; ++i) tags.push_back(made.tags[i].value);
  const char *dofs[SIZE] = {"a", "b", "c", "d", "e"};
  const solfer_time time = {0.002, 0.002, 0.002, 0.0, 1.0};
  World own;
  for (std::size_t i = 0; i < SIZE; ++i) own.all.push_back(i);
  const solfer_host host = {&own, "test", SIZE,        dofs,    &time,   tags.data(), dof,  group, links,
                            array, point, port, log_numbers, receive, publish, serve};
  char text[64] = "";
  void *instance = made.create(&host, text, sizeof text);
  if (check(instance != nullptr, text)) return 1;
  int wrong = check(made.init(instance) == 0, "init");
  own.numbers["state/velocity"].assign(SIZE, 0.5);
  own.numbers["dynamics/bias"].assign(SIZE, 7.0);
  const long before = allocations;
  for (int i = 0; i < 1000; ++i) wrong |= made.update(instance) | made.send(instance);
  wrong |= check(allocations == before, "a cycle allocates");
  if (std::strcmp(made.name, "JointSpace") == 0) {
    wrong |= check(std::fabs(own.numbers["command/torque"][4] - (7.0 - 2.0 * 0.5)) < 1e-12, "torque");
    const double offset[2] = {0.1, 0.2};
    wrong |= check(own.handlers[0](own.users[0], offset, nullptr, text, sizeof text) == 0, "a topic");
    wrong |= made.update(instance) | made.send(instance);
    wrong |= check(std::fabs(own.numbers["command/torque"][1] - (6.0 + 100.0 * 0.2)) < 1e-12, "torque of an offset");
    double request = 0.0;
    wrong |= check(own.handlers[1](own.users[1], &request, nullptr, text, sizeof text) == 1, "a refusal");
    wrong |= check(std::strstr(text, "`data`") != nullptr, text);
    wrong |= check(own.logged == SIZE && own.published == 3, "what is logged and published");
  }
  wrong |= made.reset(instance) | made.init(instance) | made.update(instance) | made.send(instance);
  wrong |= made.stop(instance);
  made.destroy(instance);
  return wrong;
}

}  // namespace

int main() {
  __sanitizer_install_malloc_and_free_hooks(count, ignore);
  const solfer_library_record *library = solfer_library();
  std::vector<double> some(100);
  int wrong = check(allocations > 0 && some.size() == 100, "allocations are counted");
  wrong |= check(library->interface_number == SOLFER_INTERFACE && library->class_count == 4, "library");
  for (std::size_t i = 0; i < library->class_count; ++i)
    if (std::strcmp(library->classes[i]->name, "Failing") != 0) wrong |= run(*library->classes[i]);
  return wrong;
}
