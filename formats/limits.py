"""Limits of the files that are read. Larger files are rejected, never cut."""

MAX_MAP_BYTES = 32 * 2**20  # of a drawing or a picture
MAX_YAML_BYTES = 16 * 2**10  # of a map_server description
MAX_LINE_BYTES = 2 * 2**20  # of a text log: some 200,000 ranges
MAX_CELLS = 40_000_000  # of a grid
MAX_SEGMENTS = 500_000  # of a map
MAX_POINTS = 200_000  # of a map, in addition to its segments; as the map index has it
MAX_ENTITIES = 500_000  # of a drawing, with what its blocks expand to
MAX_DXF_OBJECTS = 750_000  # of the text of a DXF: entities, blocks, and objects that are not drawn
MAX_DEPTH = 64  # of elements of XML, or lists of YAML, in one another
MAX_BLOCK_DEPTH = 8  # of blocks in one another
MAX_PATH_BYTES = 4 * 2**20  # of all paths of an SVG, some 20 microseconds a number
MAX_STYLE_BYTES = 2**20  # of the style elements of an SVG
MAX_STYLE_RULES = 5_000
MAX_JSON_VALUES = 6_000_000  # of JSON: commas, lists and objects, some 40 to 70 bytes each once parsed
MAX_LINES = 1_000_000  # of a CSV, with comments, and
MAX_CSV_LINE = 10_000  # characters of one
MAX_CURVE_POINTS = 10_000  # of one arc or spline
MAX_MESSAGE_BYTES = 64 * 2**20  # of one message of a bag
MAX_CHUNK_BYTES = 2**30  # of a chunk of an mcap, unpacked
MAX_RECORDED_FILES = 10_000  # of one recording
MAX_YAML_VALUES = 100_000  # that a YAML stands for, aliases counted each time
MAX_METADATA_BYTES = 256 * 2**10  # of the description of a bag of ROS 2
MAX_TRANSFORMS = 2_000_000  # of a bag, kept while its scans are read
MAX_UNITS = 1e13  # coordinates of a drawing
MAX_COORDINATE = 1e9  # m, of a curve of a DXF; farther away its pieces would be without number
MAX_TEXT = 200  # characters of a name taken from a file
MAX_NAMED = 10  # names in one message

MIN_RESOLUTION, MAX_RESOLUTION = 1e-3, 10.0  # m
MAX_ORIGIN = 1e7  # m; northings of UTM
MAX_EXTENT = 1e5  # m, of a map; as the map index has it
