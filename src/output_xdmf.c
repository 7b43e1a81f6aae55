// fields.xdmf: the frames as ParaView and VisIt open them (XDMF 2, which XDMF 3 readers read too). A temporal
// collection of pairs of grids: the grains as points and the cells as triangles between them. Light data only; every
// reference is relative to the folder. Specification: https://www.xdmf.org/index.php/XDMF_Model_and_Format
#include "output_parts.h"

#include <stdio.h>
#include <stdlib.h>

typedef struct attribute {
  const char *name, *type; // type: Float or Int
} attribute;

static void put_item(FILE *out, const char *type, int precision, long long rows, int columns, const char *reference) {
  fprintf(out, "<DataItem Format=\"HDF\" NumberType=\"%s\" Precision=\"%d\" Dimensions=\"%lld", type, precision, rows);
  if (columns > 1)
    fprintf(out, " %d", columns);
  fprintf(out, "\">%s</DataItem>", reference);
}

static void put_attributes(FILE *out, const char *group, size_t frame, const attribute *list, size_t count,
                           long long rows) {
  for (size_t k = 0; k < count; k++) {
    char reference[80];
    snprintf(reference, sizeof reference, TAL_FRAME_NAME ":/%s/%s", frame, group, list[k].name);
    fprintf(out, "     <Attribute Name=\"%s\" AttributeType=\"Scalar\" Center=\"%s\">", list[k].name,
            group[0] == 'g' ? "Node" : "Cell");
    put_item(out, list[k].type, 8, rows, 1, reference);
    fprintf(out, "</Attribute>\n");
  }
}

static void put_points(FILE *out, size_t frame, long long grains) {
  char reference[80];
  snprintf(reference, sizeof reference, TAL_FRAME_NAME ":/grains/position", frame);
  fprintf(out, "     <Geometry GeometryType=\"XYZ\">");
  put_item(out, "Float", 8, grains, 3, reference);
  fprintf(out, "</Geometry>\n");
}

static void put_grains(FILE *out, size_t frame, long long grains) {
  static const attribute list[] = {
      {"id", "Int"},          {"r", "Float"},         {"theta", "Float"},     {"vx", "Float"},        {"vy", "Float"},
      {"omega", "Float"},     {"fx", "Float"},        {"fy", "Float"},        {"torque", "Float"},    {"mass", "Float"},
      {"stress_xx", "Float"}, {"stress_xy", "Float"}, {"stress_yx", "Float"}, {"stress_yy", "Float"},
  };
  fprintf(out, "    <Grid Name=\"grains\" GridType=\"Uniform\">\n");
  // XDMF 3 makes no points without a list of nodes; ids are the indices 0..n-1.
  char reference[80];
  snprintf(reference, sizeof reference, TAL_FRAME_NAME ":/grains/id", frame);
  fprintf(out, "     <Topology TopologyType=\"Polyvertex\" NodesPerElement=\"1\" NumberOfElements=\"%lld\">", grains);
  put_item(out, "Int", 8, grains, 1, reference);
  fprintf(out, "</Topology>\n");
  put_points(out, frame, grains);
  put_attributes(out, "grains", frame, list, sizeof list / sizeof *list, grains);
  fprintf(out, "    </Grid>\n");
}

static void put_cells(FILE *out, size_t frame, long long grains, long long cells) {
  static const attribute list[] = {{"L_II", "Float"}, {"pressure", "Float"}, {"area", "Float"}};
  char reference[80];
  snprintf(reference, sizeof reference, TAL_FRAME_NAME ":/cells/corner", frame);
  fprintf(out, "    <Grid Name=\"cells\" GridType=\"Uniform\">\n");
  fprintf(out, "     <Topology TopologyType=\"Triangle\" NumberOfElements=\"%lld\">", cells);
  put_item(out, "Int", 4, cells, 3, reference);
  fprintf(out, "</Topology>\n");
  put_points(out, frame, grains);
  put_attributes(out, "cells", frame, list, sizeof list / sizeof *list, cells);
  fprintf(out, "    </Grid>\n");
}

static void put_document(FILE *out, const tal_run_files *files) {
  fprintf(out, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<Xdmf Version=\"2.0\">\n <Domain>\n"
               "  <Grid Name=\"frames\" GridType=\"Collection\" CollectionType=\"Temporal\">\n");
  for (size_t k = 0; k < files->frame_count; k++) {
    const tal_frame_mark *frame = &files->frame[k];
    fprintf(out, "   <Grid Name=\"%06zu\" GridType=\"Collection\" CollectionType=\"Spatial\">\n", k);
    fprintf(out, "    <Time Value=\"%.17g\"/>\n", frame->time);
    put_grains(out, k, frame->grains);
    if (frame->cells > 0)
      put_cells(out, k, frame->grains, frame->cells);
    fprintf(out, "   </Grid>\n");
  }
  fprintf(out, "  </Grid>\n </Domain>\n</Xdmf>\n");
}

tal_status tal_xdmf_write(tal_output *output, tal_error *err) {
  char path[TAL_PATH_SIZE], *text = NULL;
  size_t size = 0;
  FILE *out = tal_text_begin(&text, &size);
  tal_file_path(path, output->dir, "fields.xdmf");
  put_document(out, &output->files);
  tal_text_end(out);
  tal_status status = tal_file_replace(path, NULL, text, size, err);
  free(text);
  if (status == TAL_OK)
    output->listed_frames = output->files.frame_count;
  return status;
}
