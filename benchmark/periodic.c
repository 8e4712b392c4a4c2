/* A bare periodic loop: how late it wakes up, and how many periods it misses. Arguments: period [ns], cycles, priority
   of SCHED_FIFO (0: the ordinary scheduler). Prints p50, p99 and maximum of the lateness [us], and the periods missed. */

#define _GNU_SOURCE
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <time.h>

static long long now(void) {
  struct timespec time;
  clock_gettime(CLOCK_MONOTONIC, &time);
  return 1000000000LL * time.tv_sec + time.tv_nsec;
}

static int ascending(const void *one, const void *other) {
  long long a = *(const long long *)one, b = *(const long long *)other;
  return (a > b) - (a < b);
}

int main(int count, char **arguments) {
  if (count != 4) return 2;
  const long long period = atoll(arguments[1]), cycles = atoll(arguments[2]);
  const struct sched_param priority = {.sched_priority = atoi(arguments[3])};
  long long *late = calloc(cycles, sizeof *late), missed = 0;
  if (!late || cycles < 1) return 2;
  prctl(PR_SET_TIMERSLACK, 1UL);
  mlockall(MCL_CURRENT | MCL_FUTURE);
  if (priority.sched_priority && sched_setscheduler(0, SCHED_FIFO, &priority)) return 3;
  long long deadline = now();
  for (long long cycle = 0; cycle < cycles; cycle++) {
    const long long behind = (now() - deadline) / period;
    if (behind > 0) missed += behind, deadline += behind * period;
    deadline += period;
    const struct timespec until = {deadline / 1000000000LL, deadline % 1000000000LL};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
    late[cycle] = now() - deadline;
  }
  qsort(late, cycles, sizeof *late, ascending);
  printf("%.1f %.1f %.1f %lld\n", 1e-3 * late[cycles / 2], 1e-3 * late[cycles * 99 / 100], 1e-3 * late[cycles - 1],
         missed);
  return 0;
}
