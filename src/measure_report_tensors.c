// tensors.csv: fabric and anisotropies of the whole, the strong and the weak network, frame by frame.
#include "measure_list.h"

static const char header[] = TAL_ROW
    ",network,contacts,mean_fn[N],mean_branch[m],contact_xx,contact_xy,contact_yy,branch_xx,branch_xy,branch_yy,"
    "normal_xx,normal_xy,normal_yy,tangential_xx,tangential_xy,tangential_yy,a_c,theta_c[deg],a_l,theta_l[deg],"
    "a_n,theta_n[deg],a_t,theta_t[deg],area[m^2],stress_xx[Pa],stress_xy[Pa],stress_yy[Pa],stress_1[Pa],"
    "stress_2[Pa],theta_stress[deg],stress_ratio,relation_ratio,relation_full_ratio,relation_full_error";

static void put_tensor(FILE *out, geo_tensor a) {
  tal_put_symmetric(out, a.xx, a.xy, a.yx, a.yy);
}

static void put_anisotropy(FILE *out, tal_anisotropy a) {
  tal_put(out, a.size);
  tal_put(out, a.angle * 180 / TAL_PI);
}

static void put_stress(FILE *out, const tal_fabric *f, double area) {
  const tal_principal p = tal_principal_of(f->stress);
  tal_put(out, area);
  put_tensor(out, f->stress);
  tal_put(out, p.major);
  tal_put(out, p.minor);
  tal_put(out, p.major != p.minor ? p.angle * 180 / TAL_PI : 0);
  tal_put(out, f->stress_ratio);
  tal_put(out, f->relation_ratio);
  tal_put(out, f->relation_full_ratio);
  tal_put(out, f->relation_full_error);
}

static void put_row(tal_measuring *run, const tal_part *part, FILE *out, tal_network network) {
  const tal_fabric f = tal_fabric_measure(part, network, run->facts.thickness);
  tal_measuring_row(run, part, out);
  fprintf(out, ",%s,%zu", tal_network_name(network), f.contacts);
  tal_put(out, f.mean_fn);
  tal_put(out, f.mean_branch);
  put_tensor(out, f.contact);
  put_tensor(out, f.branch);
  put_tensor(out, f.normal);
  put_tensor(out, f.tangential);
  put_anisotropy(out, f.a_c);
  put_anisotropy(out, f.a_l);
  put_anisotropy(out, f.a_n);
  put_anisotropy(out, f.a_t);
  put_stress(out, &f, part->area);
  fputc('\n', out);
}

static void frame(void *state, tal_measuring *run, const tal_part *part) {
  (void)state;
  FILE *out = tal_tables_get(&run->tables, "tensors.csv", header);
  for (tal_network network = TAL_NETWORK_ALL; network <= TAL_NETWORK_WEAK; network++)
    put_row(run, part, out, network);
}

const tal_measurement tal_measurement_tensors = {NULL, frame, NULL};
