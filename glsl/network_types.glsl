// Structures of thermal networks shared with Rust. Their twins in src/gpu/layout/ document the members.

struct NetworkLink {
    uint neighbour;
    float conductance;
    float exchange;
};

struct NetworkPass {
    uint count;
    uint sensed_at;
    uint mode;
    float time;
    float space_temperature;
    float mu;
    float nu;
    float mu_step;
    float gamma_step;
    float inverse_step;
    float accuracy;
};

struct NetworkSolver {
    float gamma;
    float alpha;
    float step;
    float beta;
    float gamma_start;
    float gamma_first;
    float gradients;
    float gradients_done;
    float newtons;
    float newtons_done;
    float most_gradients;
    float most_newtons;
    float iterations;
    float short_gradients;
    float short_newtons;
    float lost;
    float largest_move;
};

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
