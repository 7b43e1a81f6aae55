// Rows of a minimal boundary: linear functions of the loop's velocities that it holds at given values, eqs (80)-(86).
// The first four are the components of the mean velocity gradient, the others (order p > 0, ours) say that the
// deviation from the affine motion does no work on the tractions of polynomial stress fields without mean.
// A row is at the same time the force on the loop's grains per unit of its multiplier.
#ifndef TAL_BOUNDARY_ROWS_H
#define TAL_BOUNDARY_ROWS_H

#include "boundary_loop.h"
#include <stdbool.h>
#include <stdint.h>

// The components of the mean velocity gradient L and the multiplier's stress that goes with each (83).
typedef enum tal_component { TAL_XX, TAL_YY, TAL_XY, TAL_SPIN, TAL_COMPONENTS } tal_component;

// Highest order, and the rows that it brings: 4 + (4 + 5 + ... + 11).
enum { TAL_ORDER_MOST = 8, TAL_ROWS_MOST = TAL_COMPONENTS + 60 };

// Fields whose tractions on the loop are, beside the largest, smaller than this share of it are left out (86).
#define TAL_ROWS_CUTOFF 1e-3

// The equations (82) of the rows in force, scaled to a unit diagonal and decomposed.
typedef struct tal_row_equations {
  size_t count;
  size_t row[TAL_ROWS_MOST];
  double scale[TAL_ROWS_MOST], aim[TAL_ROWS_MOST];
  double matrix[TAL_ROWS_MOST * TAL_ROWS_MOST], tau[TAL_ROWS_MOST];
} tal_row_equations;

// Vectors over the loop hold x and y of node 0, x and y of node 1, ...
typedef struct tal_rows {
  size_t nodes;     // B of the loop
  size_t fields;    // higher stress fields asked for
  size_t rank;      // how many of them (mixed) are kept
  double thickness; // [m]
  double area;      // [m^2] of the loop now
  geo_vec *normal;  // owned; [B] N_A now [m]
  double *shape;    // owned; [fields][2B], rank used: forces of the kept fields on the loop of the last refresh [m^2]
  double *row;      // owned; [4 + fields][2B], 4 + rank used: rows now [m^2]: N per Pa
  double *velocity, *force, *given, *other; // owned; [2B] scratch of those who solve
  double *mobility;                         // owned; [B] scratch
  tal_row_equations equations;              // scratch of those who solve in several goes
  double multiplier[TAL_ROWS_MOST];         // [Pa] of components (not held: 0), then of fields
} tal_rows;

void tal_rows_init(tal_rows *rows);
void tal_rows_clear(tal_rows *rows);
// Settles on the fields for a fresh loop (85), (86): x, y [grains] centres of the refresh, inverse_mass [grains] 1/kg,
// held: the components that are imposed, order p >= 0. Multipliers are left alone. rows->thickness is the caller's.
void tal_rows_refresh(tal_rows *rows, const geo_loop *loop, const double *x, const double *y,
                      const double *inverse_mass, const bool held[TAL_COMPONENTS], int order);
// Normals, area and rows for centres that have moved since (84).
void tal_rows_move(tal_rows *rows, const geo_loop *loop, const double *x, const double *y);
// Mean gradient (32) of a velocity over the loop, [2B] [m/s].
geo_tensor tal_rows_gradient(const tal_rows *rows, const double *velocity);
// Adds the forces of the multipliers to force [2B] [N].
void tal_rows_force(const tal_rows *rows, double *force);
// Sets up the equations for `mobility`[B] [m/s per N], the mean gradient `target` in the held components and no work on
// the fields (82). False where the rows cannot be met (no grain of the loop can move).
bool tal_rows_set_up(const tal_rows *rows, const bool held[TAL_COMPONENTS], geo_tensor target, const double *mobility,
                     tal_row_equations *equations);
// Adds to the multipliers what `velocity` [2B] lacks to meet the rows, and corrects it.
void tal_rows_correct(tal_rows *rows, tal_row_equations *equations, const double *mobility, double *velocity);
// Both, from multipliers of 0, which they stay where it returns false.
bool tal_rows_solve(tal_rows *rows, const bool held[TAL_COMPONENTS], geo_tensor target, const double *mobility,
                    double *velocity);
// E : L for component k: L_xx, L_yy, L_xy + L_yx, L_yx - L_xy.
double tal_component_of(tal_component k, geo_tensor gradient);

#endif
