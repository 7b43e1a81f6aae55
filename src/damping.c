#include "damping.h"

#include "law.h"

static bool is_hertz(const tal_scene *scene) {
  return (tal_normal_law_find(scene->contact.normal)->effects & TAL_EFFECT_HERTZ) != 0;
}

double tal_damping_number(const tal_scene *scene) {
  double e = scene->contact.restitution;
  if (isnan(e))
    return (double)NAN;
  return is_hertz(scene) ? tal_impact_hertz_number(e) : tal_linear_damping_ratio(e);
}

bool tal_damping_any(const tal_scene *scene) {
  const tal_scene_contact *law = &scene->contact;
  return law->restitution < 1 || (is_hertz(scene) ? scene->material.damping : law->damping) > 0;
}

double tal_damping_coefficient(const tal_scene *scene, const tal_constants *constants, double stiffness,
                               double reduced_mass) {
  const double number = constants->damping_number;
  if (is_hertz(scene)) {
    if (isnan(number))
      return scene->material.damping * stiffness;
    if (number == 0 || reduced_mass == 0)
      return 0;
    return number * tal_impact_hertz_time(stiffness, reduced_mass, constants->restitution_speed) * stiffness;
  }
  return isnan(number) ? scene->contact.damping : 2 * number * sqrt(stiffness * reduced_mass);
}

double tal_damping_time_of_slots(const tal_sim *sim) {
  const bool one = sim->effects & TAL_EFFECT_HERTZ && isnan(sim->constants.damping_number);
  return one ? sim->scene->material.damping : (double)NAN;
}

double tal_damping_of_slot(const tal_sim *sim, const tal_contacts *slots, size_t c) {
  if (slots->damping)
    return slots->damping[c];
  return sim->effects & TAL_EFFECT_DAMPING ? tal_damping_time_of_slots(sim) * slots->stiffness[c] : 0;
}

tal_pair tal_damping_mean_pair(const tal_scene *scene, const tal_constants *constants) {
  tal_pair pair = {.reduced_mass = constants->mean_mass / 2};
  bool hertz = is_hertz(scene);
  pair.stiffness = hertz ? tal_hertz_stiffness(constants->modulus, constants->modulus, constants->mean_radius / 2)
                         : scene->contact.stiffness;
  pair.damping = tal_damping_coefficient(scene, constants, pair.stiffness, pair.reduced_mass);
  if (hertz)
    pair.damping /= pair.stiffness;
  return pair;
}

double tal_damping_time(const tal_scene *scene, const tal_pair *pair, double speed) {
  return is_hertz(scene) ? tal_impact_hertz_time(pair->stiffness, pair->reduced_mass, speed)
                         : sqrt(pair->reduced_mass / pair->stiffness);
}

double tal_damping_number_at(const tal_scene *scene, const tal_pair *pair, double speed) {
  return is_hertz(scene) ? pair->damping / tal_damping_time(scene, pair, speed)
                         : pair->damping / (2 * sqrt(pair->stiffness * pair->reduced_mass));
}

tal_impact tal_damping_impact(const tal_scene *scene, const tal_pair *pair, double speed) {
  double number = tal_damping_number_at(scene, pair, speed);
  tal_impact impact = is_hertz(scene) ? tal_impact_hertz(number) : tal_impact_linear(number);
  impact.duration *= tal_damping_time(scene, pair, speed);
  return impact;
}
