// Backend: CGAL's Delaunay_triangulation_2 and Regular_triangulation_2 with exact predicates, inserted in spatial
// order. The project's only C++ file and optional: built only where TAL_HAVE_CGAL is defined. Needs -ffp-contract=off,
// and with gcc -frounding-math (CGAL's interval arithmetic changes the rounding mode).
#ifdef TAL_HAVE_CGAL

#ifndef CGAL_NDEBUG
#define CGAL_NDEBUG 1 // its internal checks; delaunay.c checks the result itself
#endif

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Regular_triangulation_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <cstdio>
#include <exception>
#include <utility>
#include <vector>

extern "C" {
#include "delaunay_backend.h"
}

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

using Plain_vertex = CGAL::Triangulation_vertex_base_with_info_2<int32_t, Kernel>;
using Plain = CGAL::Delaunay_triangulation_2<Kernel, CGAL::Triangulation_data_structure_2<Plain_vertex>>;

using Power_vertex =
    CGAL::Triangulation_vertex_base_with_info_2<int32_t, Kernel, CGAL::Regular_triangulation_vertex_base_2<Kernel>>;
using Power_face = CGAL::Regular_triangulation_face_base_2<Kernel>;
using Power = CGAL::Regular_triangulation_2<Kernel, CGAL::Triangulation_data_structure_2<Power_vertex, Power_face>>;

template <class Triangulation, class Site>
void triangulate(const std::vector<std::pair<Site, int32_t>> &sites, geo_mesh *mesh) {
  Triangulation triangulation;
  triangulation.insert(sites.begin(), sites.end());
  std::vector<int32_t> corners;
  corners.reserve(3 * triangulation.number_of_faces());
  for (auto face = triangulation.finite_faces_begin(); face != triangulation.finite_faces_end(); ++face)
    for (int k = 0; k < 3; k++)
      corners.push_back(face->vertex(k)->info());
  geo_mesh_set(mesh, sites.size(), reinterpret_cast<const int32_t(*)[3]>(corners.data()), corners.size() / 3);
}

void build_plain(const double *x, const double *y, size_t n, geo_mesh *mesh) {
  std::vector<std::pair<Kernel::Point_2, int32_t>> sites;
  sites.reserve(n);
  for (size_t i = 0; i < n; i++)
    sites.emplace_back(Kernel::Point_2(x[i], y[i]), int32_t(i));
  triangulate<Plain>(sites, mesh);
}

void build_power(const double *x, const double *y, const double *weight, size_t n, geo_mesh *mesh) {
  std::vector<std::pair<Kernel::Weighted_point_2, int32_t>> sites;
  sites.reserve(n);
  for (size_t i = 0; i < n; i++)
    sites.emplace_back(Kernel::Weighted_point_2(Kernel::Point_2(x[i], y[i]), weight[i]), int32_t(i));
  triangulate<Power>(sites, mesh);
}

geo_delaunay_result build(const double *x, const double *y, const double *weight, size_t n, geo_mesh *mesh,
                          geo_delaunay_report *report) {
  try {
    if (weight)
      build_power(x, y, weight, n, mesh);
    else
      build_plain(x, y, n, mesh);
  } catch (const std::exception &problem) {
    std::snprintf(report->text, sizeof report->text, "CGAL failed: %s", problem.what());
    return GEO_DELAUNAY_BACKEND;
  }
  return GEO_DELAUNAY_OK;
}

} // namespace

extern "C" const geo_delaunay_backend geo_delaunay_cgal = {
    "cgal", "CGAL, exact predicates (Delaunay_triangulation_2, Regular_triangulation_2)", build};

#endif
