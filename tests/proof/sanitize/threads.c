/* OpenMP as ThreadSanitizer understands it: every parallel region starts threads and joins them.
 *
 * Linked before libgomp, whose own threads meet by atomics and futexes that the sanitizer does not
 * see: it reports races in every loop there. This has what gfortran asks for in these sources, and
 * nothing else: regions with static schedules, barriers, and numbers of threads.
 */
#include <pthread.h>
#include <stdbool.h>
#include <stdlib.h>

struct team {
  void (*loop)(void *);
  void *data;
  int count;
  pthread_barrier_t barrier;
};
struct member {
  struct team *team;
  int number;
};

static int most = 1; /* threads of the next region */
static _Thread_local struct member here = {NULL, 0};

static void *run(void *argument) {
  here = *(struct member *)argument;
  here.team->loop(here.team->data);
  return NULL;
}

void GOMP_parallel(void (*loop)(void *), void *data, unsigned count, unsigned flags) {
  (void)flags;
  struct member before = here;
  struct team team = {.loop = loop, .data = data, .count = count > 0 ? (int)count : most};
  if (before.team != NULL) team.count = 1; /* a region within a region */
  pthread_t *threads = calloc(team.count, sizeof *threads);
  struct member *members = calloc(team.count, sizeof *members);
  if (threads == NULL || members == NULL) abort();
  pthread_barrier_init(&team.barrier, NULL, team.count);
  for (int k = 0; k < team.count; k++) {
    members[k] = (struct member){&team, k};
    if (k > 0 && pthread_create(&threads[k], NULL, run, &members[k]) != 0) abort();
  }
  run(&members[0]);
  for (int k = 1; k < team.count; k++) pthread_join(threads[k], NULL);
  pthread_barrier_destroy(&team.barrier);
  free(members);
  free(threads);
  here = before;
}

void GOMP_barrier(void) {
  if (here.team != NULL) pthread_barrier_wait(&here.team->barrier);
}

int omp_get_num_threads(void) { return here.team != NULL ? here.team->count : 1; }
int omp_get_thread_num(void) { return here.number; }

/* as Fortran calls them */
int omp_get_num_threads_(void) { return omp_get_num_threads(); }
int omp_get_thread_num_(void) { return here.number; }
int omp_get_max_threads_(void) { return most; }
int omp_get_num_procs_(void) { return 2; }
int omp_in_parallel_(void) { return here.team != NULL && here.team->count > 1; }
void omp_set_num_threads_(const int *count) { most = *count > 0 ? *count : 1; }
