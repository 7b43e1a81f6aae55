// The tables of `talus rotation` and its words.
#include "rotation.h"

#include "files.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

enum { SHELLS = 40 };

static double degrees(geo_vec axis) {
  return atan2(axis.y, axis.x) * 180 / TAL_PI;
}

// A comma before each, nan where there is no number.
static void put(FILE *out, size_t count, ...) {
  va_list values;
  va_start(values, count);
  for (size_t k = 0; k < count; k++) {
    const double value = va_arg(values, double);
    if (isnan(value))
      fputs(",nan", out);
    else
      fprintf(out, ",%.17g", value);
  }
  va_end(values);
  fputc('\n', out);
}

static void forced(FILE *out, const tal_rotations *all) {
  fputs("sample,grain,contacts,load,x[m],y[m],omega[rad/s],rim,segments,T_xx,T_xy,T_yx,T_yy,T_major,T_minor,axis[deg],"
        "amplitude,amplitude_error,length,length_error,influence\n",
        out);
  for (size_t g = 0; g < all->count; g++) {
    const tal_rotation *a = &all->item[g];
    fprintf(out, "%zu,%lld,%zu", a->sample, (long long)a->grain, a->contacts);
    put(out, 18, a->load, a->x, a->y, a->omega, a->rim, (double)a->segments, a->tensor.xx, a->tensor.xy, a->tensor.yx,
        a->tensor.yy, a->value[0], a->value[1], degrees(a->axis[0]), a->decay.amplitude, a->decay.amplitude_error,
        a->decay.length, a->decay.length_error, a->influence);
  }
}

static void sectors(FILE *out, const tal_rotations *all) {
  fputs("sample,grain,angle[deg],grains,W,across,transmission\n", out);
  for (size_t g = 0; g < all->count; g++)
    for (int k = 0; k < TAL_SECTORS; k++) {
      const tal_rotation *a = &all->item[g];
      fprintf(out, "%zu,%lld,%g,%zu", a->sample, (long long)a->grain, (k + 0.5) * 360 / TAL_SECTORS, a->used[k]);
      put(out, 3, a->along[k], a->across[k], a->transmission[k]);
    }
}

// Over the forced grains: mean, smallest and largest of their shells' means.
static void shells(FILE *out, const tal_rotations *all) {
  fputs("distance,forced_grains,ratio,ratio_least,ratio_most\n", out);
  for (size_t k = 0; k < SHELLS; k++) {
    double sum = 0, least = HUGE_VAL, most = 0;
    size_t count = 0;
    for (size_t g = 0; g < all->count; g++) {
      const double ratio = tal_rotation_shell(&all->item[g], k);
      if (isnan(ratio))
        continue;
      sum += ratio;
      least = fmin(least, ratio);
      most = fmax(most, ratio);
      count++;
    }
    if (!count)
      continue;
    fprintf(out, "%g,%zu", (double)k + 0.5, count);
    put(out, 3, sum / (double)count, least, most);
  }
}

static void points(FILE *out, const tal_rotations *all) {
  const tal_rotation *a = &all->item[0];
  fputs("distance,angle[rad],ratio\n", out);
  for (size_t k = 0; k < a->points; k++) {
    fprintf(out, "%.17g", a->r[k]);
    put(out, 2, a->angle[k], a->ratio[k]);
  }
}

static tal_status write_table(const tal_rotations *all, const char *folder, const char *name,
                              void (*fill)(FILE *out, const tal_rotations *all), tal_error *err) {
  char path[TAL_PATH_SIZE], *text = NULL;
  size_t size;
  FILE *out = tal_text_begin(&text, &size);
  fill(out, all);
  tal_text_end(out);
  tal_file_path(path, folder, name);
  tal_status status = tal_file_replace(path, NULL, text, size, err);
  free(text);
  return status;
}

tal_status tal_rotations_write(const tal_rotations *all, const char *dir, tal_error *err) {
  static const struct {
    const char *name;
    void (*fill)(FILE *out, const tal_rotations *all);
  } tables[] = {{"forced.csv", forced}, {"sectors.csv", sectors}, {"shells.csv", shells}, {"points.csv", points}};
  char folder[TAL_PATH_SIZE];
  tal_file_path(folder, dir, "rotation");
  tal_status status = tal_folder_create(folder, err);
  for (size_t k = 0; k < (all->count == 1 ? 4 : 3) && status == TAL_OK; k++)
    status = write_table(all, folder, tables[k].name, tables[k].fill, err);
  return status;
}

// ---- words ----

static void say_interval(FILE *out, const char *what, tal_interval i, const char *rest) {
  if (isnan(i.value))
    fprintf(out, "  %-34s     none\n", what);
  else
    fprintf(out, "  %-34s %8.3f  [%.3f, %.3f]%s\n", what, i.value, i.low, i.high, rest);
}

static void say_one(FILE *out, const tal_rotation *a, double reach) {
  fprintf(out, "%s: grain %lld at (%.4g, %.4g) mm, %zu contacts that bear %.3g of <f>, t = %.4g s\n", a->run,
          (long long)a->grain, 1e3 * a->x, 1e3 * a->y, a->contacts, a->load, a->time);
  fprintf(out, "  T  [%.4g %.4g; %.4g %.4g] of %zu segments within %g mean diameters\n", a->tensor.xx, a->tensor.xy,
          a->tensor.yx, a->tensor.yy, a->segments, reach);
  fprintf(out, "  Sym(T)  %.4g along %.1f deg, %.4g across\n", a->value[0], degrees(a->axis[0]), a->value[1]);
  if (a->rim < reach)
    fprintf(out,
            "  the cutoff reaches beyond the rim, which is %.1f mean diameters away: T and W know one side better\n",
            a->rim);
  if (a->contacts < 2)
    fprintf(out, "  the grain is a rattler: there is nothing that could transmit its spin\n");
  if (!a->forced || a->omega == 0)
    return;
  if (!tal_rotation_transmits(a))
    fprintf(out, "  no other grain reaches %.0f %%: it slips on all its contacts\n", 100 * TAL_INFLUENCE);
  if (a->decay.points)
    fprintf(out, "  |omega|/omega0 = %.3f exp(-r/l), l = %.3f +- %.3f mean diameters, %zu grains within %g\n",
            a->decay.amplitude, a->decay.length, a->decay.length_error, a->decay.points, reach);
  else
    fprintf(out, "  nothing that decays: no length\n");
  fprintf(out, "  influence (%.0f %%) to %.2f mean diameters\n", 100 * TAL_INFLUENCE, a->influence);
}

static void say_all(FILE *out, const tal_rotations *all, double reach) {
  const tal_sector_statistics *s = &all->sectors;
  fprintf(out, "%zu forced grains in %zu samples, cutoff %g mean diameters; intervals of %.0f %%\n", all->count,
          all->samples, reach, 100 * all->confidence);
  say_interval(out, "share that transmits (5 %)", all->share, "");
  say_interval(out, "load on those, of <f>", all->load, "");
  say_interval(out, "load on the others", all->load_others, "");
  fprintf(out, "the %zu that transmit:\n", all->transmitting);
  say_interval(out, "decay length, mean", all->length, " mean diameters");
  fprintf(out, "  %-34s %8.3f  [%.3f, %.3f]\n", "decay length, median and 5-95 %", all->length_median, all->length_low,
          all->length_high);
  say_interval(out, "influence radius, mean", all->influence, " mean diameters");
  fprintf(out, "transmission of %zu sectors of %d degrees\n", s->sectors, 360 / TAL_SECTORS);
  say_interval(out, "correlation with W", s->along, "");
  say_interval(out, "correlation with chains across", s->across, "");
  say_interval(out, "slope on W, both at once", s->along_slope, " standard deviations");
  say_interval(out, "slope on chains across", s->across_slope, " standard deviations");
  say_interval(out, "mean, fewest chains across", s->open, " of the grain's mean");
  say_interval(out, "mean, most chains across", s->blocked, " of the grain's mean");
}

char *tal_rotations_text(const tal_rotations *all, const tal_rotation_options *options) {
  char *text = NULL;
  size_t size;
  FILE *out = tal_text_begin(&text, &size);
  if (all->count == 1)
    say_one(out, &all->item[0], options->reach);
  else
    say_all(out, all, options->reach);
  tal_text_end(out);
  return text;
}
