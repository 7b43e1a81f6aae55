// chains.csv: force chains and strong clusters frame by frame. chain_lives.csv: one line per chain over its life.
// buckling.csv: every event. chain_list.csv, chain_grains.csv, chain_lengths.csv and the map chains-NNNNNN.png: of the
// frames of --at.
#include "measure_chain_lives.h"
#include "measure_map.h"

#include <math.h>
#include <stdlib.h>

static const double degrees = 180 / TAL_PI;

static void *create(tal_measuring *run) {
  tal_tables_get(&run->tables, "chains.csv",
                 TAL_ROW ",mean_stress_1[Pa],bearing_grains,strong_grains,chains,chain_grains,mean_grains,longest,"
                         "mean_length[m],straightness,direction[deg],alignment,goes_on,born,gone_on,ended,segments,"
                         "buckled,clusters,largest_cluster,cluster_share,spans_x,spans_y");
  tal_tables_get(&run->tables, "buckling.csv",
                 TAL_ROW ",chain,grain_a,grain_b,grain_c,x[m],y[m],angle_before[deg],angle_after[deg],load_lost");
  return tal_alloc(1, sizeof(tal_chain_tracker));
}

// ---- frame by frame ----

typedef struct means {
  double grains, length, straight, cos2, sin2;
  size_t longest;
} means;

static means means_of(const tal_chains *chains) {
  means m = {0};
  const double n = (double)chains->count;
  for (size_t c = 0; c < chains->count; c++) {
    const tal_chain *chain = &chains->chain[c];
    m.grains += (double)chain->count / n;
    m.length += chain->length / n;
    m.straight += chain->span / chain->length / n;
    m.cos2 += cos(2 * chain->angle) / n;
    m.sin2 += sin(2 * chain->angle) / n;
    m.longest = chain->count > m.longest ? chain->count : m.longest;
  }
  return m;
}

static void put_chains(FILE *out, const tal_chains *chains) {
  const means m = means_of(chains);
  const double order = hypot(m.cos2, m.sin2), angle = atan2(m.sin2, m.cos2) / 2 * degrees;
  const double excess = m.grains - TAL_CHAIN_LEAST; // (M19)
  tal_put(out, chains->mean_major);
  fprintf(out, ",%zu,%zu,%zu,%zu", chains->bearing, chains->strong, chains->count, chains->grain_count);
  tal_put(out, m.grains);
  fprintf(out, ",%zu", m.longest);
  tal_put(out, m.length);
  tal_put(out, m.straight);
  tal_put(out, order > 0 ? angle + (angle < 0 ? 180 : 0) : 0);
  tal_put(out, order);
  tal_put(out, chains->count ? excess / (1 + excess) : 0);
}

static void put_events(tal_measuring *run, const tal_part *part, const tal_chain_tracker *tracker) {
  FILE *out = tal_tables_get(&run->tables, "buckling.csv", "");
  const tal_snapshot *s = part->of;
  for (size_t k = 0; k < tracker->event_count; k++) {
    const tal_buckling *event = &tracker->event[k];
    tal_measuring_row(run, part, out);
    fprintf(out, ",%zu,%lld,%lld,%lld", event->life, (long long)s->id[event->grain[0]],
            (long long)s->id[event->grain[1]], (long long)s->id[event->grain[2]]);
    tal_put(out, s->x[event->grain[1]]);
    tal_put(out, s->y[event->grain[1]]);
    tal_put(out, event->before * degrees);
    tal_put(out, event->after * degrees);
    tal_put(out, event->lost);
    fputc('\n', out);
  }
}

// ---- the frames of --at ----

static void put_list(tal_measuring *run, const tal_part *part, const tal_chain_tracker *tracker) {
  FILE *out = tal_tables_get(&run->tables, "chain_list.csv",
                             TAL_ROW ",chain,grains,length[m],span[m],direction[deg],mean_fn[N],stress_1[Pa]");
  FILE *members = tal_tables_get(&run->tables, "chain_grains.csv", TAL_ROW ",chain,place,id,x[m],y[m]");
  const tal_chains *chains = &tracker->before;
  for (size_t c = 0; c < chains->count; c++) {
    const tal_chain *chain = &chains->chain[c];
    tal_measuring_row(run, part, out);
    fprintf(out, ",%zu,%zu", tracker->id[c], chain->count);
    tal_put(out, chain->length);
    tal_put(out, chain->span);
    tal_put(out, chain->angle * degrees);
    tal_put(out, chain->mean_fn);
    tal_put(out, chain->stress);
    fputc('\n', out);
    for (size_t k = 0; k < chain->count; k++) {
      const int32_t grain = chains->grain[chain->first + k];
      tal_measuring_row(run, part, members);
      fprintf(members, ",%zu,%zu,%lld", tracker->id[c], k, (long long)part->of->id[grain]);
      tal_put(members, part->of->x[grain]);
      tal_put(members, part->of->y[grain]);
      fputc('\n', members);
    }
  }
}

static void put_lengths(tal_measuring *run, const tal_part *part, const tal_chains *chains) {
  FILE *out = tal_tables_get(&run->tables, "chain_lengths.csv", TAL_ROW ",grains,chains");
  size_t longest = 0, *count = tal_alloc(chains->grain_count + 1, sizeof *count);
  for (size_t c = 0; c < chains->count; c++) {
    count[chains->chain[c].count]++;
    longest = chains->chain[c].count > longest ? chains->chain[c].count : longest;
  }
  for (size_t length = TAL_CHAIN_LEAST; length <= longest; length++) {
    tal_measuring_row(run, part, out);
    fprintf(out, ",%zu,%zu\n", length, count[length]);
  }
  free(count);
}

static void draw_events(tal_measure_map *m, const tal_snapshot *s, const tal_chain_tracker *tracker) {
  if (!tracker->event_count)
    return;
  FILE *data = tal_plot_data(&m->plot, "events");
  for (size_t k = 0; data && k < tracker->event_count; k++) {
    const int32_t grain = tracker->event[k].grain[1];
    fprintf(data, "%.9g %.9g %.6g\n", 1e3 * s->x[grain], 1e3 * s->y[grain], 1e3 * s->r[grain]);
  }
  tal_plot_data_end(&m->plot, data);
  tal_plot_element(&m->plot);
  fputs("'events' using 1:2:3 with circles fs empty border lc rgb '#0072b2' lw 4", m->plot.script);
}

static void draw(tal_measuring *run, const tal_part *part, const tal_chain_tracker *tracker) {
  const tal_snapshot *s = part->of;
  tal_measure_map m;
  if (!tal_measure_map_begin(&m, run, "force chains", 4, false))
    return;
  const double width = 0.1 * part->mean_diameter * m.map.scale;
  tal_map_heading(&m.map, &m.plot, 2, "%zu chains (red) of %zu grains, line width ∝ f_n,  ⟨f_n⟩ = %.3g N",
                  tracker->before.count, tracker->before.grain_count, part->mean_fn);
  tal_map_heading(&m.map, &m.plot, 3, "circles: %zu buckled since the frame before", tracker->event_count);
  tal_measure_map_discs(&m, s);
  tal_measure_map_contacts(&m, s, part->contact, part->contact_count, part->mean_fn, width, "contacts", "#93a1c9");
  tal_measure_map_contacts(&m, s, tracker->before.link, tracker->before.link_count, part->mean_fn, width, "links",
                           "#b2281e");
  draw_events(&m, s, tracker);
  tal_map_walls(&m.data.last, &m.plot);
  tal_measure_map_end(&m, run, "chains");
}

static void frame(void *state, tal_measuring *run, const tal_part *part) {
  tal_chain_tracker *tracker = state;
  tal_chains chains;
  tal_chains_find(&chains, part, run->options->angle > 0 ? run->options->angle : TAL_CHAIN_ANGLE);
  const tal_clusters clusters = tal_clusters_find(part);
  FILE *out = tal_tables_get(&run->tables, "chains.csv", "");
  tal_measuring_row(run, part, out);
  put_chains(out, &chains);
  tal_chain_tracker_add(tracker, &chains, part->of, run->frame);
  fprintf(out, ",%zu,%zu,%zu,%zu,%zu,%zu,%zu", tracker->born, tracker->gone_on, tracker->ended, tracker->segments,
          tracker->event_count, clusters.count, clusters.largest);
  tal_put(out, clusters.share);
  fprintf(out, ",%d,%d\n", clusters.spans_x, clusters.spans_y);
  put_events(run, part, tracker);
  if (!run->detail)
    return;
  put_list(run, part, tracker);
  put_lengths(run, part, &tracker->before);
  if (run->options->figures && part->contact_count)
    draw(run, part, tracker);
}

static void finish(void *state, tal_measuring *run) {
  tal_chain_tracker *tracker = state;
  FILE *out = tal_tables_get(&run->tables, "chain_lives.csv",
                             "chain,born_frame,last_frame,born_time[s],last_time[s],born_strain,last_strain,frames,"
                             "longest,buckled,from_start,to_end");
  tal_chain_tracker_end(tracker);
  for (size_t k = 0; k < tracker->life_count; k++) {
    const tal_chain_life *life = &tracker->life[k];
    fprintf(out, "%zu,%zu,%zu", k, life->born, life->last);
    tal_put(out, life->born_time);
    tal_put(out, life->last_time);
    tal_put(out, life->born_strain);
    tal_put(out, life->last_strain);
    fprintf(out, ",%zu,%zu,%zu,%d,%d\n", life->frames, life->longest, life->buckled, life->from_start, life->to_end);
  }
  tal_chain_tracker_clear(tracker);
  free(tracker);
}

const tal_measurement tal_measurement_chains = {create, frame, finish};
