"""Controllers at their best under limits."""
