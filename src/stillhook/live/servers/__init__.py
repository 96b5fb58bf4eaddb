"""How others reach the live twin: OPC UA, Modbus TCP, UDP."""
