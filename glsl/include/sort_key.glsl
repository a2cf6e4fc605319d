// A key of a sort in a buffer: a word, or (NARROW) half of one. Only loads and stores are narrow: uint(keys[i]), and
// keys[i] = KEY(key). Devices without 16-bit storage have no narrow variants.
#ifdef NARROW
#extension GL_EXT_shader_16bit_storage : require
#define KEY uint16_t
#else
#define KEY uint
#endif
