/* The interface between solfer and a component in a library of its own, in plain C.
 *
 * C++ uses component.hpp, which is made of this. Other languages export `solfer_library` and fill the records below.
 * The host calls everything of one component from one thread at a time, and never in the middle of a cycle.
 * Functions that return an int return 0 where all is well; the text of an error is `error(instance)`.
 */
#ifndef SOLFER_COMPONENT_H
#define SOLFER_COMPONENT_H

#include <stddef.h>

#define SOLFER_INTERFACE 1 /* changes with any record below */

#if defined(_WIN32)
#define SOLFER_EXPORT __declspec(dllexport)
#else
#define SOLFER_EXPORT __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Live numbers, row by row. The record stays where it is; the host sets `data` before the first `init` at the latest,
 * and again before a cycle if the numbers have moved. */
typedef struct {
  double *data;
  size_t rows;
  size_t columns; /* 1 for a vector */
} solfer_array;

/* The value of a tag: one of these, by its kind. Numbers of live tags change between two cycles. */
typedef struct {
  double number; /* also of an integer, and 0 or 1 of a switch */
  const char *text;
  const double *numbers;
  size_t size; /* of `numbers` */
} solfer_value;

typedef enum { SOLFER_NUMBER, SOLFER_INTEGER, SOLFER_SWITCH, SOLFER_TEXT, SOLFER_NUMBERS } solfer_kind;

/* A key of the component in the configuration. */
typedef struct {
  const char *name;
  const char *description; /* with the unit of a number, as in "how far it goes [rad]" */
  solfer_kind kind;
  int is_required; /* 0: `value` counts where the configuration has none */
  int is_live;     /* 1: a number that may change while the component runs */
  solfer_value value;
  double lower; /* bounds of each number; -HUGE_VAL and HUGE_VAL: none */
  double upper;
} solfer_tag;

/* The time of a cycle, as `Component` in Python has it [s]. */
typedef struct {
  double period;
  double passed;
  double step;
  double lost;
  double pace; /* share of their speed with which motions go on */
} solfer_time;

/* A jump of the estimate of the base: a place p of the world goes to after + Rz(yaw) (p - before) [m, rad]. */
typedef struct {
  double before[3];
  double after[3];
  double yaw;
} solfer_move;

/* Receives numbers; `reply` is NULL for a topic. On error it writes a text of at most `size` bytes, and returns 1. */
typedef int (*solfer_handler)(void *user, const double *numbers, double *reply, char *error, size_t size);

/* A Robot Point: its numbers, and its Jacobian with a column for each DoF. */
typedef struct {
  int index; /* names it as an operand */
  solfer_array value;
  solfer_array jacobian;
} solfer_point;

/* What a Robot Point is made of; kinds are those of solfer.points. */
typedef struct {
  const char *kind;
  const char *link; /* of a link; else empty */
  const int *operands;
  size_t operand_count;
  const double *numbers; /* an offset on the link, or the value of a constant */
  size_t number_count;
} solfer_point_request;

/* A topic or a service. Fields are paths to numbers: "twist.linear.x", "data[7]"; what is sent may end in ":int" or
 * ":bool". What does not belong to a kind of endpoint stays zero. */
typedef struct {
  const char *name;
  const char *interface;
  const char *const *fields; /* of the message, or of the request */
  size_t field_count;
  const char *const *reply_fields; /* of a service; `success` and `message` come by themselves */
  size_t reply_field_count;
  const double *numbers; /* what a topic publishes */
  double rate;           /* how often; 0: after each cycle [Hz] */
  solfer_handler handler;
  void *user; /* of the handler */
} solfer_endpoint;

/* What the host offers while a component is created. Functions return NULL, or -1, after an error; the host keeps its
 * text, and `create` has to return NULL then. What they return is valid until `destroy`. */
typedef struct {
  void *context;
  const char *name; /* of the configuration */
  size_t size;      /* number of DoFs */
  const char *const *dofs;
  const solfer_time *time;
  const solfer_value *tags; /* in the order in which the class declares them */
  long (*dof)(void *context, const char *name);
  const size_t *(*group)(void *context, const char *name, size_t *count); /* DoFs of an SRDF group, or of a map */
  const char *const *(*links)(void *context, const char *group, size_t *count);
  /* Sources: state, motor, command, lower_limits, upper_limits with an interface ("position"), an interface that
   * `command` lacks is added; dynamics with bias, inertia, inertia_inverse; start with "position". */
  const solfer_array *(*array)(void *context, const char *source, const char *name);
  /* Points are computed in their order before each `update`. */
  const solfer_point *(*point)(void *context, const solfer_point_request *request);
  const solfer_array *(*port)(void *context, int is_output, const char *name, const char *quantity);
  int (*log)(void *context, const char *name, const double *numbers, size_t size, const char *unit);
  int (*receive)(void *context, const solfer_endpoint *endpoint);
  int (*publish)(void *context, const solfer_endpoint *endpoint);
  int (*serve)(void *context, const solfer_endpoint *endpoint);
} solfer_host;

/* A class of components. `create` gets room for the text of an error. NULL: it has no such function. */
typedef struct {
  const char *name;
  const char *description;
  const solfer_tag *tags;
  size_t tag_count;
  void *(*create)(const solfer_host *host, char *error, size_t size);
  void (*destroy)(void *instance);
  int (*init)(void *instance);
  int (*update)(void *instance);
  int (*send)(void *instance);
  int (*reset)(void *instance);
  int (*stop)(void *instance);
  int (*move_world)(void *instance, const solfer_move *move);
  const char *(*error)(void *instance);
} solfer_class;

typedef struct {
  unsigned interface_number; /* SOLFER_INTERFACE of the headers that the library was built with; always the first */
  size_t class_count;
  const solfer_class *const *classes;
} solfer_library_record;

/* The one symbol of a library of components. */
SOLFER_EXPORT const solfer_library_record *solfer_library(void);

#ifdef __cplusplus
}
#endif
#endif
