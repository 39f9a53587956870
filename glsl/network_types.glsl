// Structures of thermal networks shared with Rust. Their twins in src/gpu/layout/ document the members.

struct HeaterStep {
    uint heaters;
    uint first;
    uint trial;
    float start;
    float step;
};

struct NetworkStage {
    uint end;
    float rate;
    float here;
    float older;
    float part;
};

struct NetworkStep {
    uint first;
    uint end;
    uint count;
    uint since;
    float step;
    float space_temperature_4;
};
