// Given to the compiler ahead of a hot file (hot.h) that it compiles for one width of vectors: all that the file shares
// with others gets the width into its name.
#define TAL_JOIN(name, width)   TAL_JOIN_2(name, width)
#define TAL_JOIN_2(name, width) name##_##width
#define TAL_WIDE(name)          TAL_JOIN(name, TAL_WIDTH)

#define tal_contact_block TAL_WIDE(tal_contact_block)
#define tal_sweep_of      TAL_WIDE(tal_sweep_of)
#define tal_kick          TAL_WIDE(tal_kick)
#define tal_kick_book     TAL_WIDE(tal_kick_book)
#define tal_forces_range  TAL_WIDE(tal_forces_range)
#define tal_drift_group   TAL_WIDE(tal_drift_group)
#define tal_drift_records TAL_WIDE(tal_drift_records)
#define tal_drift_foresee TAL_WIDE(tal_drift_foresee)
#define tal_implicit_take TAL_WIDE(tal_implicit_take)
#define tal_implicit_work TAL_WIDE(tal_implicit_work)
