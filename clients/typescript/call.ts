// The README's request by a client whose types come from the service's OpenAPI document: `make clients`.
import createClient from "openapi-fetch";
import type { paths } from "./schema.js";

const client = createClient<paths>({ baseUrl: process.argv[2] ?? "http://127.0.0.1:8000" });
const { data, error } = await client.POST("/v1/associate", {
  body: {
    map: { segments: [[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]] },
    scan: {
      segments: [[-1.01, 0.99, -0.99, -4.98], [-1, -4.99, 0.98, -5.01], [1.01, -2.99, 3.98, -3.01], [4.01, -2.98, 3.99, 0.98], [1.6, -0.8, 1.2, -0.4]],
      sigma: 0.02,
    },
  },
});
if (error) throw new Error(error.detail);
console.log(`${data.status} ${data.usable} ${data.pose?.x.toFixed(3)}`);
