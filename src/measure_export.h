// Any field of a frame as CSV.
#ifndef TAL_MEASURE_EXPORT_H
#define TAL_MEASURE_EXPORT_H

#include "base.h"

// Writes the data sets of `field` of the frame file `path` to `csv`: "contacts/fn" one, "contacts" all of that group
// side by side, one row per grain, contact, cell ... The header is name[unit]; the columns of a table have its name
// with _xx _xy _yx _yy, _xx _xy _yy, or _0 _1 ... behind. Reals have 17 digits. TAL_BAD_INPUT when there is no such
// field, naming those there are; TAL_IO.
tal_status tal_frame_export(const char *path, const char *field, const char *csv, tal_error *err);
// TAL_OK when the frame has that field.
tal_status tal_frame_has(const char *path, const char *field, tal_error *err);

#endif
